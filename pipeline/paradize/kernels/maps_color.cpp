#include "maps_color.hpp"

#include "maps_parallel.hpp"
#include "mathx.hpp"

#include <array>
#include <vector>

namespace paradize::maps {
namespace {

float clamp01(float v) {
    return v < 0.0F ? 0.0F : (v > 1.0F ? 1.0F : v);
}

std::size_t color_channels(std::size_t channels) {
    return channels == 2 || channels == 4 ? channels - 1 : channels;
}

// table[i] = linear light of code i of 0..top.
std::vector<float> linear_table(int top) {
    std::vector<float> table(static_cast<std::size_t>(top) + 1);
    for (int i = 0; i <= top; ++i) {
        table[static_cast<std::size_t>(i)] =
            static_cast<float>(mathx::srgb_to_linear(i / static_cast<double>(top)));
    }
    return table;
}

// Which code a linear value rounds to: the first guess from a coarse table, then the exact thresholds.
struct Rounding {
    static constexpr int steps = 4096;
    std::array<float, 257> threshold{}; // threshold[i]: the least value that rounds to code i or above
    std::array<std::uint8_t, steps + 1> guess{};

    Rounding() {
        threshold[0] = 0.0F;
        for (int i = 1; i < 256; ++i) {
            const double edge = mathx::srgb_to_linear((i - 0.5) / 255.0);
            threshold[static_cast<std::size_t>(i)] = static_cast<float>(edge);
        }
        threshold[256] = 2.0F;
        std::size_t code = 0;
        for (int step = 0; step <= steps; ++step) {
            const float low = static_cast<float>(step) / steps;
            while (threshold[code + 1] <= low) {
                ++code;
            }
            guess[static_cast<std::size_t>(step)] = static_cast<std::uint8_t>(code);
        }
    }

    std::uint8_t operator()(float v) const {
        const float a = clamp01(v);
        std::size_t code = guess[static_cast<std::size_t>(a * steps)];
        while (a >= threshold[code + 1]) {
            ++code;
        }
        return static_cast<std::uint8_t>(code);
    }
};

} // namespace

void srgb_to_linear(std::span<const float> in, std::size_t channels, int source_bits, std::span<float> out,
                    int threads) {
    const std::size_t colors = color_channels(channels);
    const int top = source_bits == 8 ? 255 : (source_bits == 16 ? 65535 : 0);
    const std::vector<float> table = top != 0 ? linear_table(top) : std::vector<float>{};
    for_rows(in.size() / channels, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first * channels; i < last * channels; i += channels) {
            for (std::size_t c = 0; c < channels; ++c) {
                const float v = in[i + c];
                if (c >= colors) {
                    out[i + c] = v;
                } else if (top != 0 && v >= 0.0F && v <= 1.0F) {
                    out[i + c] = table[static_cast<std::size_t>(v * static_cast<float>(top) + 0.5F)];
                } else {
                    out[i + c] = static_cast<float>(mathx::srgb_to_linear(v));
                }
            }
        }
    });
}

void linear_to_srgb8(std::span<const float> in, std::size_t channels, std::span<std::uint8_t> out,
                     int threads) {
    static const Rounding rounding;
    const std::size_t colors = color_channels(channels);
    for_rows(in.size() / channels, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first * channels; i < last * channels; i += channels) {
            for (std::size_t c = 0; c < channels; ++c) {
                const float v = in[i + c];
                out[i + c] = c < colors ? rounding(v) : static_cast<std::uint8_t>(clamp01(v) * 255.0F + 0.5F);
            }
        }
    });
}

void luminance(std::span<const float> in, std::size_t channels, std::span<float> out, int threads) {
    for_rows(out.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const float *texel = &in[i * channels];
            out[i] = channels < 3 ? texel[0] : 0.2126F * texel[0] + 0.7152F * texel[1] + 0.0722F * texel[2];
        }
    });
}

void apply_levels(std::span<const float> in, const Levels &levels, std::span<float> out, int threads) {
    const double range = levels.white - levels.black;
    const double power = 1.0 / levels.gamma;
    for_rows(in.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            double t = (in[i] - levels.black) / range;
            t = t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t);
            if (power != 1.0) {
                t = mathx::pow(t, power);
            }
            t = (t - 0.5) * levels.contrast + 0.5 + levels.brightness;
            t = t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t);
            out[i] = static_cast<float>(levels.invert ? 1.0 - t : t);
        }
    });
}

} // namespace paradize::maps
