#include "maps/color.hpp"

#include "math/functions.hpp"
#include "parallel.hpp"

#include <array>
#include <limits>
#include <type_traits>
#include <vector>

namespace paradize::maps {
namespace {

float clamp01(float v) {
    return v < 0.0F ? 0.0F : (v > 1.0F ? 1.0F : v);
}

constexpr std::size_t color_channels(std::size_t channels) {
    return channels == 2 || channels == 4 ? channels - 1 : channels;
}

// table[i] = linear light of code i, 0..top.
std::vector<float> linear_codes(std::size_t top) {
    std::vector<float> table(top + 1);
    for (std::size_t i = 0; i <= top; ++i) {
        table[i] =
            static_cast<float>(mathx::srgb_to_linear(static_cast<double>(i) / static_cast<double>(top)));
    }
    return table;
}

template <typename T>
const float *linear_table() {
    static const std::vector<float> table = linear_codes(std::numeric_limits<T>::max());
    return table.data();
}

// A code as a share of its largest, correctly rounded; a float as it is.
template <typename T>
float share(T v) {
    if constexpr (std::is_same_v<T, float>) {
        return v;
    } else {
        return static_cast<float>(v) / static_cast<float>(std::numeric_limits<T>::max());
    }
}

// Which code a linear value rounds to: a table's guess, and one exact threshold above it. The steps are so
// fine that no two thresholds lie in one.
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
        const unsigned code = guess[static_cast<std::size_t>(static_cast<int>(a * steps))];
        return static_cast<std::uint8_t>(code + (a >= threshold[code + 1] ? 1U : 0U));
    }
};

std::uint8_t unorm8(float v) {
    return static_cast<std::uint8_t>(clamp01(v) * 255.0F + 0.5F);
}

template <typename T>
std::uint8_t unorm8_of(T v) {
    if constexpr (std::is_same_v<T, std::uint8_t>) {
        return v;
    } else if constexpr (std::is_same_v<T, std::uint16_t>) {
        return static_cast<std::uint8_t>((v * 255U + 32767U) / 65535U);
    } else {
        return unorm8(v);
    }
}

template <typename T, std::size_t Channels>
void linear_run(const T *in, bool encoded, float *out, std::size_t count) {
    constexpr std::size_t colors = color_channels(Channels);
    [[maybe_unused]] const float *table = nullptr;
    if constexpr (!std::is_same_v<T, float>) {
        table = linear_table<T>();
    }
    for (std::size_t i = 0; i < count * Channels; i += Channels) {
        for (std::size_t c = 0; c < Channels; ++c) {
            const T v = in[i + c];
            if (!encoded || c >= colors) {
                out[i + c] = share(v);
            } else if constexpr (std::is_same_v<T, float>) {
                out[i + c] = static_cast<float>(mathx::srgb_to_linear(v));
            } else {
                out[i + c] = table[v];
            }
        }
    }
}

template <typename T, std::size_t Channels>
void rgba_run(const T *in, bool encoded, std::uint8_t *out, std::size_t count) {
    static const Rounding rounding;
    constexpr std::size_t colors = color_channels(Channels);
    for (std::size_t i = 0; i < count; ++i) {
        const T *texel = in + i * Channels;
        std::uint8_t *to = out + 4 * i;
        for (std::size_t c = 0; c < 3; ++c) {
            const T v = texel[colors == 3 ? c : 0];
            to[c] = encoded ? unorm8_of(v) : rounding(share(v));
        }
        to[3] = Channels == colors ? std::uint8_t{255} : unorm8_of(texel[Channels - 1]);
    }
}

// Calls run.template operator()<channels>() with the channels as a constant.
template <typename Run>
void with_channels(std::size_t channels, Run &&run) {
    switch (channels) {
    case 1:
        run.template operator()<1>();
        break;
    case 2:
        run.template operator()<2>();
        break;
    case 3:
        run.template operator()<3>();
        break;
    default:
        run.template operator()<4>();
        break;
    }
}

template <std::size_t Channels>
void halved_row(const std::uint8_t *above, const std::uint8_t *below, const float *table, std::size_t columns,
                float *out) {
    constexpr std::size_t colors = color_channels(Channels);
    for (std::size_t x = 0; x < columns; ++x) {
        const std::array<const std::uint8_t *, 4> texels = {above, above + Channels, below, below + Channels};
        if constexpr (colors == Channels) {
            for (std::size_t c = 0; c < colors; ++c) {
                out[c] = ((table[texels[0][c]] + table[texels[1][c]]) +
                          (table[texels[2][c]] + table[texels[3][c]])) *
                         0.25F;
            }
        } else {
            std::array<float, 4> weight{};
            float alpha = 0.0F; // sums of codes: exact
            for (std::size_t k = 0; k < 4; ++k) {
                weight[k] = static_cast<float>(texels[k][colors]);
                alpha += weight[k];
            }
            const bool clear = alpha == 0.0F;
            const float part = clear ? 0.25F : 1.0F / alpha;
            for (std::size_t c = 0; c < colors; ++c) {
                float sum = 0.0F;
                for (std::size_t k = 0; k < 4; ++k) {
                    sum += table[texels[k][c]] * (clear ? 1.0F : weight[k]);
                }
                out[c] = sum * part;
            }
            out[colors] = alpha / 1020.0F;
        }
        above += 2 * Channels;
        below += 2 * Channels;
        out += Channels;
    }
}

// One value at a time: in double, rounded once.
class LevelCurve {
  public:
    explicit LevelCurve(const Levels &levels)
        : levels_(levels), range_(levels.white - levels.black), power_(1.0 / levels.gamma) {}

    float operator()(float value) const {
        double t = unit((value - levels_.black) / range_);
        if (power_ != 1.0) {
            t = mathx::pow(t, power_);
        }
        t = unit((t - 0.5) * levels_.contrast + 0.5 + levels_.brightness);
        return static_cast<float>(levels_.invert ? 1.0 - t : t);
    }

  private:
    static double unit(double t) { return t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t); }

    Levels levels_;
    double range_;
    double power_;
};

} // namespace

template <typename T>
void linear_light(std::span<const T> in, std::size_t channels, bool encoded, std::span<float> out,
                  int threads) {
    for_rows(in.size() / channels, threads, [&](std::size_t first, std::size_t last) {
        with_channels(channels, [&]<std::size_t Channels>() {
            linear_run<T, Channels>(in.data() + first * Channels, encoded, out.data() + first * Channels,
                                    last - first);
        });
    });
}

template void linear_light(std::span<const std::uint8_t>, std::size_t, bool, std::span<float>, int);
template void linear_light(std::span<const std::uint16_t>, std::size_t, bool, std::span<float>, int);
template void linear_light(std::span<const float>, std::size_t, bool, std::span<float>, int);

void halved_light(std::span<const std::uint8_t> in, std::size_t rows, std::size_t columns,
                  std::size_t channels, std::span<float> out, int threads) {
    const float *table = linear_table<std::uint8_t>();
    for_rows(rows / 2, threads, [&](std::size_t first, std::size_t last) {
        with_channels(channels, [&]<std::size_t Channels>() {
            for (std::size_t y = first; y < last; ++y) {
                const std::uint8_t *above = in.data() + 2 * y * columns * Channels;
                halved_row<Channels>(above, above + columns * Channels, table, columns / 2,
                                     out.data() + y * (columns / 2) * Channels);
            }
        });
    });
}

template <typename T>
void rgba_codes(std::span<const T> in, std::size_t channels, bool encoded, std::span<std::uint8_t> out,
                int threads) {
    for_rows(in.size() / channels, threads, [&](std::size_t first, std::size_t last) {
        with_channels(channels, [&]<std::size_t Channels>() {
            rgba_run<T, Channels>(in.data() + first * Channels, encoded, out.data() + first * 4,
                                  last - first);
        });
    });
}

template void rgba_codes(std::span<const std::uint8_t>, std::size_t, bool, std::span<std::uint8_t>, int);
template void rgba_codes(std::span<const std::uint16_t>, std::size_t, bool, std::span<std::uint8_t>, int);
template void rgba_codes(std::span<const float>, std::size_t, bool, std::span<std::uint8_t>, int);

void luminance(std::span<const float> in, std::size_t channels, std::span<float> out, int threads) {
    for_rows(out.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const float *texel = &in[i * channels];
            out[i] = channels < 3 ? texel[0] : 0.2126F * texel[0] + 0.7152F * texel[1] + 0.0722F * texel[2];
        }
    });
}

void apply_levels(std::span<const float> in, const Levels &levels, std::span<float> out, int threads) {
    const LevelCurve curve(levels);
    for_rows(in.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            out[i] = curve(in[i]);
        }
    });
}

} // namespace paradize::maps
