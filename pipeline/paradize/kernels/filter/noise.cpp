#include "filter/noise.hpp"

#include "math/functions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::filter {
namespace {

constexpr std::size_t values_per_patch = 256;
constexpr std::size_t span = 8; // a slope is fitted to 2 * span + 1 texels each way
constexpr std::size_t every = 12;
constexpr int harmonics = 8;

// Values of the patches, a few hundred of each, spread by a stride that shares no factor with its size.
std::vector<float> sample(const Map &map, const Patches &patches) {
    const std::size_t area = patches.height * patches.width;
    const std::size_t count = std::min(area, values_per_patch);
    std::vector<float> values;
    values.reserve(patches.at.size() * count);
    for (const Patch &patch : patches.at) {
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t at = count == area ? i : i * 37 % area;
            values.push_back(
                map.heights[(patch.y + at / patches.width) * map.columns + patch.x + at % patches.width]);
        }
    }
    std::sort(values.begin(), values.end());
    return values;
}

double nominal_step(int bits) {
    return bits <= 8 ? 1.0 / 255.0 : (bits <= 16 ? 1.0 / 65535.0 : 0.0);
}

// The slope (x, y) of the plane through the texels about (y, x), in heights per texel.
struct Slope {
    double x;
    double y;
};

Slope plane(const Map &map, std::size_t y, std::size_t x) {
    constexpr auto n = static_cast<std::ptrdiff_t>(span);
    constexpr double squares = n * (n + 1) * (2 * n + 1) / 3.0 * (2 * n + 1);
    double sx = 0.0;
    double sy = 0.0;
    for (std::ptrdiff_t j = -n; j <= n; ++j) {
        const float *row = &map.heights[(y + static_cast<std::size_t>(n + j) - span) * map.columns + x];
        double sum = 0.0;
        for (std::ptrdiff_t i = -n; i <= n; ++i) {
            sum += row[i];
            sx += static_cast<double>(i) * row[i];
        }
        sy += static_cast<double>(j) * sum;
    }
    return {sx / squares, sy / squares};
}

// The two bins about a frequency in cycles per texel, aliased, and the share of the second.
struct Bins {
    std::size_t first;
    std::size_t second;
    double share;
};

Bins bins_of(double cycles, std::size_t n) {
    const double at = (cycles - std::floor(cycles)) * static_cast<double>(n);
    const double whole = std::floor(at);
    const auto first = static_cast<std::size_t>(whole) % n;
    return {first, (first + 1) % n, at - whole};
}

void add_line(std::vector<double> &lines, std::size_t columns, const Bins &y, const Bins &x, double mass) {
    lines[y.first * columns + x.first] += mass * (1.0 - y.share) * (1.0 - x.share);
    lines[y.first * columns + x.second] += mass * (1.0 - y.share) * x.share;
    lines[y.second * columns + x.first] += mass * y.share * (1.0 - x.share);
    lines[y.second * columns + x.second] += mass * y.share * x.share;
}

// A line after the patches' window, Hann's squared: the squares of 1 4 6 4 1, their sum one.
double through_window(const double *line, std::size_t i, std::size_t n, std::size_t apart) {
    const auto at = [&](std::size_t k) { return line[(i + k) % n * apart]; };
    return (36.0 * at(0) + 16.0 * (at(1) + at(n - 1)) + (at(2) + at(2 * n - 2))) / 70.0;
}

std::vector<double> windowed(const std::vector<double> &from, std::size_t rows, std::size_t columns) {
    std::vector<double> across(from.size());
    std::vector<double> both(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
        across[i] = through_window(&from[i / columns * columns], i % columns, columns, 1);
    }
    for (std::size_t i = 0; i < from.size(); ++i) {
        both[i] = through_window(&across[i % columns], i / columns, rows, columns);
    }
    return both;
}

// Of three channels, weighted as luminance is, the steps partly cancel.
constexpr double three_channels = 0.2126 * 0.2126 + 0.7152 * 0.7152 + 0.0722 * 0.0722;

// The mean of the squared distances between neighbouring codes about each of the values, which rise.
double square_between_codes(const std::vector<float> &values, std::span<const float> codes) {
    double squares = 0.0;
    std::size_t at = 0;
    for (const float value : values) {
        while (at + 1 < codes.size() && codes[at] < value) {
            ++at;
        }
        const double above = codes[std::min(at + 1, codes.size() - 1)];
        const double below = codes[at > 0 ? at - 1 : 0];
        const double gaps = at > 0 && at + 1 < codes.size() ? 2.0 : 1.0;
        squares += (above - below) * (above - below) / (gaps * gaps);
    }
    return squares / static_cast<double>(values.size());
}

} // namespace

Steps steps_of(const Map &map, const Patches &patches) {
    const std::vector<float> values = sample(map, patches);
    const double nominal = nominal_step(map.source_bits);
    std::size_t distinct = 0;
    std::size_t single = 0;
    double squares = 0.0;
    double below = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < values.size();) {
        std::size_t end = i + 1;
        while (end < values.size() && values[end] == values[i]) {
            ++end;
        }
        const double above = end < values.size() ? static_cast<double>(values[end]) - values[i]
                                                 : std::numeric_limits<double>::infinity();
        const double gap = std::min(below, above);
        if (std::isfinite(gap)) {
            squares += gap * gap * static_cast<double>(end - i);
        }
        ++distinct;
        single += end - i == 1 ? 1 : 0;
        below = above;
        i = end;
    }
    if (distinct >= 2 && 4 * single <= distinct && 3 * distinct <= values.size()) {
        double step = std::sqrt(squares / static_cast<double>(values.size()));
        if (distinct < 16) { // a mask or a staircase: its few values are no measure of its steps
            step = std::min(step, map.source_bits <= 16 ? 1.0 / 255.0 : 0.0);
        }
        if (map.codes.size() >= 2) {
            // Values of a tinted grey are nearer to each other than codes are: neighbours differ by the step
            // of one channel or another, each of which is rounded by itself.
            const double variance = square_between_codes(values, map.codes) * three_channels / 12.0;
            if (step * step / 12.0 < 0.5 * variance) {
                return {std::sqrt(12.0 * variance), variance, false};
            }
        }
        return {step, step * step / 12.0, step > 0.0};
    }
    if (map.source_bits > 16) { // float32 itself rounds to 24 bits
        const double largest = values.empty() ? 0.0
                                              : std::max(std::abs(static_cast<double>(values.front())),
                                                         std::abs(static_cast<double>(values.back())));
        const double step = largest * 0x1p-24;
        return {0.0, step * step / 12.0, false};
    }
    return {nominal, nominal * nominal / 12.0 * (map.source_bits <= 8 ? three_channels : 1.0), false};
}

std::vector<double> noise_spectrum(const Map &map, const Patches &patches, const Steps &steps) {
    const std::size_t rows = patches.height;
    const std::size_t columns = patches.width;
    const std::size_t bins = rows * columns;
    std::vector<double> white(bins, steps.variance);
    if (!steps.found || rows < 4 * span || columns < 4 * span) {
        return white;
    }
    std::vector<double> lines(bins, 0.0);
    double kept = 0.0;
    double places = 0.0;
    for (const Patch &patch : patches.at) {
        for (std::size_t y = span; y + span < rows; y += every) {
            for (std::size_t x = span; x + span < columns; x += every) {
                places += 1.0;
                const Slope slope = plane(map, patch.y + y, patch.x + x);
                const double gx = slope.x / steps.step;
                const double gy = slope.y / steps.step;
                if (!(std::max(std::abs(gx), std::abs(gy)) <= 2.0)) {
                    continue; // aliased all over
                }
                for (int m = 1; m <= harmonics; ++m) {
                    const double mass = 0.25 / (mathx::pi * mathx::pi * m * m); // half of a line's power
                    add_line(lines, columns, bins_of(m * gy, rows), bins_of(m * gx, columns), mass);
                    add_line(lines, columns, bins_of(-m * gy, rows), bins_of(-m * gx, columns), mass);
                    kept += 2.0 * mass;
                }
            }
        }
    }
    if (places == 0.0) {
        return white;
    }
    lines = windowed(lines, rows, columns);
    const double each = steps.step * steps.step * static_cast<double>(bins) / places;
    const double rest = steps.step * steps.step * (1.0 / 12.0 - kept / places);
    for (std::size_t i = 0; i < bins; ++i) {
        lines[i] = lines[i] * each + std::max(rest, 0.0);
    }
    return lines;
}

} // namespace paradize::filter
