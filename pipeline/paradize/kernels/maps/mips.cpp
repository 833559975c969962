#include "maps/mips.hpp"

#include "parallel.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace paradize::maps {
namespace {

// Up to three texels of the finer level and their weights (which sum to 1).
struct Area {
    std::size_t first;
    std::size_t count;
    std::array<double, 3> weight;
};

Area area(std::size_t index, std::size_t size) {
    if (size == 1) {
        return {0, 1, {1.0, 0.0, 0.0}};
    }
    const std::size_t half = size / 2;
    if (size % 2 == 0) {
        return {2 * index, 2, {0.5, 0.5, 0.0}};
    }
    const auto n = static_cast<double>(size);
    return {2 * index,
            3,
            {static_cast<double>(half - index) / n, static_cast<double>(half) / n,
             static_cast<double>(index + 1) / n}};
}

// Means of 2 x 2 texels, the common case, written for the vectoriser.
template <std::size_t Channels>
PARADIZE_CLONES void halve_even_row(const float *__restrict above, const float *__restrict below,
                                    std::size_t columns, float *__restrict out) {
    for (std::size_t x = 0; x < columns; ++x) {
        for (std::size_t c = 0; c < Channels; ++c) {
            const std::size_t left = 2 * x * Channels + c;
            out[x * Channels + c] =
                ((above[left] + above[left + Channels]) + (below[left] + below[left + Channels])) * 0.25F;
        }
    }
}

// A run of vectors, a lane each, so that loops over them become SIMD. What is beyond the run is (0, 0, 1).
constexpr std::size_t run = 64;
struct Vectors {
    std::array<double, run> x;
    std::array<double, run> y;
    std::array<double, run> z;
    std::array<double, run> value;
};

Vectors taken(const float *in, std::size_t count) {
    Vectors v{};
    v.z.fill(1.0);
    for (std::size_t i = 0; i < count; ++i) {
        v.x[i] = in[3 * i];
        v.y[i] = in[3 * i + 1];
        v.z[i] = in[3 * i + 2];
    }
    return v;
}

PARADIZE_CLONES void unit(Vectors &v) {
    for (std::size_t i = 0; i < run; ++i) {
        const double length = std::sqrt(v.x[i] * v.x[i] + v.y[i] * v.y[i] + v.z[i] * v.z[i]);
        const bool lost = !(length > 1e-7);
        const double divisor = lost ? 1.0 : length;
        v.x[i] = lost ? 0.0 : v.x[i] / divisor;
        v.y[i] = lost ? 0.0 : v.y[i] / divisor;
        v.z[i] = lost ? 1.0 : v.z[i] / divisor;
    }
}

// value: squared roughness becomes smoothness.
PARADIZE_CLONES void widen(Vectors &v) {
    for (std::size_t i = 0; i < run; ++i) {
        const double square = v.x[i] * v.x[i] + v.y[i] * v.y[i] + v.z[i] * v.z[i];
        const double length = std::sqrt(square);
        const double divisor = square > 1e-12 ? length * (3.0 - square) : 1.0;
        const double lost = square < 1.0 - 1e-6 ? 2.0 * (1.0 - square) / divisor : 0.0;
        const double sum = v.value[i] + lost;
        const double total = square > 1e-12 && sum < 1.0 ? sum : 1.0;
        v.value[i] = 1.0 - std::sqrt(std::sqrt(total));
    }
}

void halve_even(std::size_t channels, const float *above, const float *below, std::size_t columns,
                float *out) {
    switch (channels) {
    case 1:
        halve_even_row<1>(above, below, columns, out);
        break;
    case 2:
        halve_even_row<2>(above, below, columns, out);
        break;
    case 3:
        halve_even_row<3>(above, below, columns, out);
        break;
    default:
        halve_even_row<4>(above, below, columns, out);
        break;
    }
}

} // namespace

void halve(std::span<const float> in, const HalfRows &half, std::size_t columns, std::size_t channels,
           std::span<float> out, int threads) {
    const std::size_t out_columns = half_size(columns);
    const bool even = half.rows % 2 == 0 && columns % 2 == 0 && channels <= 4;
    for_rows(half.count, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            float *to = &out[y * out_columns * channels];
            if (even) {
                const float *above = &in[2 * y * columns * channels];
                halve_even(channels, above, above + columns * channels, out_columns, to);
                continue;
            }
            const Area down = area(half.first + y, half.rows);
            const std::size_t top = down.first - 2 * half.first;
            for (std::size_t x = 0; x < out_columns; ++x) {
                const Area across = area(x, columns);
                for (std::size_t c = 0; c < channels; ++c) {
                    double sum = 0.0;
                    for (std::size_t j = 0; j < down.count; ++j) {
                        double line = 0.0;
                        for (std::size_t i = 0; i < across.count; ++i) {
                            const std::size_t at = ((top + j) * columns + across.first + i) * channels + c;
                            line += across.weight[i] * in[at];
                        }
                        sum += down.weight[j] * line;
                    }
                    to[x * channels + c] = static_cast<float>(sum);
                }
            }
        }
    });
}

void halve_with_alpha(std::span<const float> in, const HalfRows &half, std::size_t columns,
                      std::size_t channels, std::span<float> out, int threads) {
    const std::size_t out_columns = half_size(columns);
    const std::size_t colors = channels - 1;
    for_rows(half.count, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            const Area down = area(half.first + y, half.rows);
            const std::size_t top = down.first - 2 * half.first;
            for (std::size_t x = 0; x < out_columns; ++x) {
                const Area across = area(x, columns);
                std::array<double, 3> weighted{};
                std::array<double, 3> plain{};
                double alpha = 0.0;
                for (std::size_t j = 0; j < down.count; ++j) {
                    for (std::size_t i = 0; i < across.count; ++i) {
                        const float *texel = &in[((top + j) * columns + across.first + i) * channels];
                        const double weight = down.weight[j] * across.weight[i];
                        const double opaque = weight * texel[colors];
                        alpha += opaque;
                        for (std::size_t c = 0; c < colors; ++c) {
                            plain[c] += weight * texel[c];
                            weighted[c] += opaque * texel[c];
                        }
                    }
                }
                float *to = &out[(y * out_columns + x) * channels];
                for (std::size_t c = 0; c < colors; ++c) {
                    to[c] = static_cast<float>(alpha > 0.0 ? weighted[c] / alpha : plain[c]);
                }
                to[colors] = static_cast<float>(alpha);
            }
        }
    });
}

void normalise(std::span<const float> in, std::span<float> out, int threads) {
    for_rows(in.size() / 3, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t at = begin; at < end; at += run) {
            const std::size_t count = std::min(run, end - at);
            Vectors v = taken(&in[3 * at], count);
            unit(v);
            for (std::size_t i = 0; i < count; ++i) {
                float *to = &out[3 * (at + i)];
                to[0] = static_cast<float>(v.x[i]);
                to[1] = static_cast<float>(v.y[i]);
                to[2] = static_cast<float>(v.z[i]);
            }
        }
    });
}

double coverage_factor(std::span<const float> alpha, double fraction, double cutoff) {
    const auto wanted = static_cast<std::size_t>(fraction * static_cast<double>(alpha.size()) + 0.5);
    if (wanted == 0 || wanted > alpha.size()) {
        return 1.0;
    }
    std::vector<float> sorted(alpha.begin(), alpha.end());
    const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(wanted - 1);
    std::nth_element(sorted.begin(), nth, sorted.end(), std::greater<float>());
    const double least = *nth; // the least opaque texel that shall stay
    if (!(least > 0.0)) {
        return 1.0;
    }
    const double factor = cutoff / least * (1.0 + 1e-6);
    return std::clamp(factor, 1.0 / 16.0, 16.0);
}

void smoothness_to_variance(std::span<const float> smoothness, std::span<float> variance, int threads) {
    for_rows(smoothness.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double rough = 1.0 - smoothness[i];
            variance[i] = static_cast<float>(rough * rough * rough * rough);
        }
    });
}

void widened_smoothness(std::span<const float> variance, std::span<const float> averages,
                        std::span<float> smoothness, int threads) {
    for_rows(variance.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t at = begin; at < end; at += run) {
            const std::size_t count = std::min(run, end - at);
            Vectors v = taken(&averages[3 * at], count);
            for (std::size_t i = 0; i < count; ++i) {
                v.value[i] = variance[at + i];
            }
            widen(v);
            for (std::size_t i = 0; i < count; ++i) {
                smoothness[at + i] = static_cast<float>(v.value[i]);
            }
        }
    });
}

} // namespace paradize::maps
