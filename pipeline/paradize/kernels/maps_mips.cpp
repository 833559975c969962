#include "maps_mips.hpp"

#include "maps_parallel.hpp"

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

void halve(std::span<const float> in, std::size_t rows, std::size_t columns, std::size_t channels,
           std::span<float> out, int threads) {
    const std::size_t out_rows = half_size(rows);
    const std::size_t out_columns = half_size(columns);
    const bool even = rows % 2 == 0 && columns % 2 == 0 && channels <= 4;
    for_rows(out_rows, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            float *to = &out[y * out_columns * channels];
            if (even) {
                const float *above = &in[2 * y * columns * channels];
                halve_even(channels, above, above + columns * channels, out_columns, to);
                continue;
            }
            const Area down = area(y, rows);
            for (std::size_t x = 0; x < out_columns; ++x) {
                const Area across = area(x, columns);
                for (std::size_t c = 0; c < channels; ++c) {
                    double sum = 0.0;
                    for (std::size_t j = 0; j < down.count; ++j) {
                        double line = 0.0;
                        for (std::size_t i = 0; i < across.count; ++i) {
                            const std::size_t at =
                                ((down.first + j) * columns + across.first + i) * channels + c;
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

void halve_with_alpha(std::span<const float> in, std::size_t rows, std::size_t columns, std::size_t channels,
                      std::span<float> out, int threads) {
    const std::size_t out_columns = half_size(columns);
    const std::size_t colors = channels - 1;
    for_rows(half_size(rows), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            const Area down = area(y, rows);
            for (std::size_t x = 0; x < out_columns; ++x) {
                const Area across = area(x, columns);
                std::array<double, 3> weighted{};
                std::array<double, 3> plain{};
                double alpha = 0.0;
                for (std::size_t j = 0; j < down.count; ++j) {
                    for (std::size_t i = 0; i < across.count; ++i) {
                        const float *texel = &in[((down.first + j) * columns + across.first + i) * channels];
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
        for (std::size_t i = 3 * begin; i < 3 * end; i += 3) {
            const double x = in[i];
            const double y = in[i + 1];
            const double z = in[i + 2];
            const double length = std::sqrt(x * x + y * y + z * z);
            if (length > 1e-7) {
                out[i] = static_cast<float>(x / length);
                out[i + 1] = static_cast<float>(y / length);
                out[i + 2] = static_cast<float>(z / length);
            } else {
                out[i] = 0.0F;
                out[i + 1] = 0.0F;
                out[i + 2] = 1.0F;
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
        for (std::size_t i = begin; i < end; ++i) {
            const double x = averages[3 * i];
            const double y = averages[3 * i + 1];
            const double z = averages[3 * i + 2];
            const double square = x * x + y * y + z * z;
            double total = 1.0;
            if (square > 1e-12) {
                const double length = std::sqrt(square);
                const double lost =
                    square < 1.0 - 1e-6 ? 2.0 * (1.0 - square) / (length * (3.0 - square)) : 0.0;
                total = std::min(1.0, variance[i] + lost);
            }
            smoothness[i] = static_cast<float>(1.0 - std::sqrt(std::sqrt(total)));
        }
    });
}

} // namespace paradize::maps
