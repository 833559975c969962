#include "filter/choose.hpp"

#include "filter/noise.hpp"
#include "math/functions.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace paradize::filter {
namespace {

// Median power where both frequencies are high: no white noise is stronger.
double corner(const std::vector<double> &power, std::size_t rows, std::size_t columns) {
    std::vector<double> found;
    const auto high = [](std::size_t i, std::size_t n) {
        return n == 1 || (8 * i >= 3 * n && 8 * i <= 5 * n);
    };
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            if (high(y, rows) && high(x, columns)) {
                found.push_back(power[y * columns + x]);
            }
        }
    }
    const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
    std::nth_element(found.begin(), middle, found.end());
    return *middle;
}

// Means over 5 x 5 bins, around the spectrum.
std::vector<double> softened(const std::vector<double> &from, std::size_t rows, std::size_t columns) {
    std::vector<double> across(from.size(), 0.0);
    std::vector<double> both(from.size(), 0.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
        for (std::size_t k = 0; k < 5; ++k) {
            const std::size_t x = (i % columns + k + columns * 2 - 2) % columns;
            across[i] += 0.2 * from[i / columns * columns + x];
        }
    }
    for (std::size_t i = 0; i < from.size(); ++i) {
        for (std::size_t k = 0; k < 5; ++k) {
            const std::size_t y = (i / columns + k + rows * 2 - 2) % rows;
            both[i] += 0.2 * across[y * columns + i % columns];
        }
    }
    return both;
}

// The spectrum less the noise, where it stands out of it alone or with its neighbours: the fewer patches
// there are that share no texel, the farther chance lifts a bin.
std::vector<double> beyond_noise(const std::vector<double> &power, const std::vector<double> &noise,
                                 const Patches &patches, const Map &map) {
    const auto area = static_cast<double>(patches.height * patches.width);
    const double apart = std::clamp(1.5 * static_cast<double>(map.rows * map.columns) / area, 1.0,
                                    static_cast<double>(patches.at.size()));
    const double alone = 1.5 + 6.0 / std::sqrt(apart);
    const double together = 1.5 + 3.0 / std::sqrt(apart);
    const std::vector<double> soft = softened(power, patches.height, patches.width);
    const std::vector<double> soft_noise = softened(noise, patches.height, patches.width);
    std::vector<double> out(power.size(), 0.0);
    for (std::size_t i = 0; i < power.size(); ++i) {
        if (power[i] > alone * noise[i] || soft[i] > together * soft_noise[i]) {
            out[i] = power[i] - noise[i]; // negative ones too: their sum is what counts
        }
    }
    return out;
}

// A spectrum that is as strong at the highest frequencies goes on beyond them, and was folded back when the
// map was sampled: half of the power at the edge of the spectrum, and less within, as if it fell with the
// square of the frequency. It moves from the signal to the noise, because nobody can tell its slope.
void take_aliases(std::vector<double> &signal, std::vector<double> &noise, std::size_t rows,
                  std::size_t columns) {
    const auto frequency = [](std::size_t i, std::size_t n) {
        return static_cast<double>(std::min(i, n - i)) / static_cast<double>(n);
    };
    double edge = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i) {
        if (std::max(frequency(i / columns, rows), frequency(i % columns, columns)) >= 0.45) {
            edge += signal[i];
            count += 1.0;
        }
    }
    edge = count > 0.0 ? std::max(edge, 0.0) / count : 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i) {
        const double f = std::max(frequency(i / columns, rows), frequency(i % columns, columns));
        const double folded =
            std::clamp(0.125 * edge / ((1.0 - f) * (1.0 - f)), 0.0, std::max(signal[i], 0.0));
        signal[i] -= folded;
        noise[i] += folded;
    }
}

// The response of a filter along and across at the wave numbers of one axis of a patch.
struct Response {
    std::vector<double> slope;
    std::vector<double> smooth;
};

Response response(std::span<const double> derivative, std::span<const double> smooth, std::size_t n,
                  const std::vector<double> &sines, const std::vector<double> &cosines) {
    Response out{std::vector<double>(n, 0.0), std::vector<double>(n, smooth[0])};
    for (std::size_t k = 1; k <= reach; ++k) {
        if (derivative[k - 1] == 0.0 && smooth[k] == 0.0) {
            continue;
        }
        for (std::size_t i = 0; i < n; ++i) {
            const std::size_t turn = i * k & (n - 1); // n is a power of two
            out.slope[i] += 2.0 * derivative[k - 1] * sines[turn];
            out.smooth[i] += 2.0 * smooth[k] * cosines[turn];
        }
    }
    return out;
}

struct Waves {
    std::vector<double> number; // radians per texel, signed
    std::vector<double> sines;
    std::vector<double> cosines;

    explicit Waves(std::size_t n) : number(n), sines(n), cosines(n) {
        for (std::size_t i = 0; i < n; ++i) {
            const double turn = 2.0 * mathx::pi / static_cast<double>(n);
            sines[i] = mathx::sin(turn * static_cast<double>(i));
            cosines[i] = mathx::cos(turn * static_cast<double>(i));
            number[i] = turn * (static_cast<double>(i) - (2 * i > n ? static_cast<double>(n) : 0.0));
        }
    }
    // Whether bin i alternates from texel to texel: it has no slope that texels could tell.
    bool alternates(std::size_t i) const { return 2 * i == number.size(); }
};

// Half of a spectrum: the other half mirrors it, and is counted in the weights.
struct Spectrum {
    Spectrum(std::size_t all_rows, std::size_t columns_)
        : rows(all_rows / 2 + 1), columns(columns_), signal(rows * columns, 0.0), noise(rows * columns, 0.0) {
    }

    std::size_t rows;
    std::size_t columns;
    std::vector<double> signal;
    std::vector<double> noise;
};

// One row of bins: truncation and noise, in eight sums side by side, each in the order of the bins.
PARADIZE_CLONES void add_row(const double *__restrict signal, const double *__restrict noise,
                             const double *__restrict slope, const double *__restrict smooth,
                             const double *__restrict number, double slope_y, double smooth_y,
                             double number_y, std::size_t columns, double *__restrict sums) {
    constexpr std::size_t side = 8;
    const std::size_t whole = columns / side * side;
    for (std::size_t x = 0; x < whole; x += side) {
        for (std::size_t k = 0; k < side; ++k) {
            const double hx = slope[x + k] * smooth_y;
            const double hy = slope_y * smooth[x + k];
            const double ex = hx - number[x + k];
            const double ey = hy - number_y;
            sums[k] += signal[x + k] * (ex * ex + ey * ey) + noise[x + k] * (hx * hx + hy * hy);
        }
    }
    for (std::size_t x = whole; x < columns; ++x) {
        const double hx = slope[x] * smooth_y;
        const double hy = slope_y * smooth[x];
        const double ex = hx - number[x];
        const double ey = hy - number_y;
        sums[0] += signal[x] * (ex * ex + ey * ey) + noise[x] * (hx * hx + hy * hy);
    }
}

// The mean square error of a filter over the spectrum.
double square_error(const Spectrum &spectrum, const Waves &wx, const Waves &wy, const Response &rx,
                    const Response &ry) {
    std::array<double, 8> sums{};
    for (std::size_t y = 0; y < spectrum.rows; ++y) {
        add_row(&spectrum.signal[y * spectrum.columns], &spectrum.noise[y * spectrum.columns],
                rx.slope.data(), rx.smooth.data(), wx.number.data(), ry.slope[y], ry.smooth[y], wy.number[y],
                spectrum.columns, sums.data());
    }
    return ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
}

} // namespace

Prediction predict_errors(const Map &map, std::span<const double> derivative,
                          std::span<const double> smooth) {
    const std::size_t filters = derivative.size() / reach;
    Prediction out{std::vector<double>(filters, 0.0), 0.0};
    const Patches patches = patches_of(map);
    const std::size_t rows = patches.height;
    const std::size_t columns = patches.width;
    if (patches.at.empty() || rows * columns == 1) {
        return out;
    }
    std::vector<double> signal = power_spectrum(map, patches);
    Steps steps = steps_of(map, patches);
    if (!steps.found) {
        steps.variance = std::min(steps.variance, corner(signal, rows, columns));
    }
    out.step = steps.step;
    std::vector<double> noise = noise_spectrum(map, patches, steps);
    signal = beyond_noise(signal, noise, patches, map);
    take_aliases(signal, noise, rows, columns);
    const Waves wx(columns);
    const Waves wy(rows);
    Spectrum spectrum(rows, columns);
    for (std::size_t y = 0; y < spectrum.rows; ++y) {
        const bool once = y == 0; // the rows below the middle mirror those above
        for (std::size_t x = 0; x < columns; ++x) {
            if (!wx.alternates(x) && !wy.alternates(y)) {
                const double weight = (once ? 1.0 : 2.0) / static_cast<double>(rows * columns);
                spectrum.signal[y * columns + x] = weight * signal[y * columns + x];
                spectrum.noise[y * columns + x] = weight * noise[y * columns + x];
            }
        }
    }
    for (std::size_t f = 0; f < filters; ++f) {
        const auto d = derivative.subspan(f * reach, reach);
        const auto s = smooth.subspan(f * (reach + 1), reach + 1);
        out.errors[f] = square_error(spectrum, wx, wy, response(d, s, columns, wx.sines, wx.cosines),
                                     response(d, s, rows, wy.sines, wy.cosines));
    }
    return out;
}

} // namespace paradize::filter
