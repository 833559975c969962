#include "filter_noise.hpp"

#include "mathx.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::filter {
namespace {

constexpr std::size_t values_per_patch = 256;
constexpr std::size_t span = 4; // a slope is fitted to 2 * span + 1 texels each way
constexpr std::size_t every = 4;
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

std::size_t bin_of(double cycles, std::size_t n) {
    const double whole = cycles - std::floor(cycles);
    return static_cast<std::size_t>(whole * static_cast<double>(n) + 0.5) % n;
}

// Each bin shares with its neighbours: a slope that changes within the patch widens its lines.
std::vector<double> widened(const std::vector<double> &from, std::size_t rows, std::size_t columns) {
    std::vector<double> across(from.size());
    std::vector<double> both(from.size());
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            const double *row = &from[y * columns];
            across[y * columns + x] =
                0.5 * row[x] + 0.25 * (row[(x + 1) % columns] + row[(x + columns - 1) % columns]);
        }
    }
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            both[y * columns + x] =
                0.5 * across[y * columns + x] +
                0.25 * (across[(y + 1) % rows * columns + x] + across[(y + rows - 1) % rows * columns + x]);
        }
    }
    return both;
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
        return {step, step * step / 12.0, step > 0.0};
    }
    if (map.source_bits > 16) { // float32 itself rounds to 24 bits
        const double largest = values.empty() ? 0.0
                                              : std::max(std::abs(static_cast<double>(values.front())),
                                                         std::abs(static_cast<double>(values.back())));
        const double step = largest * 0x1p-24;
        return {0.0, step * step / 12.0, false};
    }
    // Of three channels, weighted as luminance is, the steps partly cancel.
    constexpr double weights = 0.2126 * 0.2126 + 0.7152 * 0.7152 + 0.0722 * 0.0722;
    return {nominal, nominal * nominal / 12.0 * (map.source_bits <= 8 ? weights : 1.0), false};
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
                if (std::max(std::abs(gx), std::abs(gy)) > 2.0) {
                    continue; // aliased all over
                }
                for (int m = 1; m <= harmonics; ++m) {
                    const double mass = 0.25 / (mathx::pi * mathx::pi * m * m); // half of a line's power
                    lines[bin_of(m * gy, rows) * columns + bin_of(m * gx, columns)] += mass;
                    lines[bin_of(-m * gy, rows) * columns + bin_of(-m * gx, columns)] += mass;
                    kept += 2.0 * mass;
                }
            }
        }
    }
    if (places == 0.0) {
        return white;
    }
    lines = widened(lines, rows, columns);
    const double each = steps.step * steps.step * static_cast<double>(bins) / places;
    const double rest = steps.step * steps.step * (1.0 / 12.0 - kept / places);
    for (std::size_t i = 0; i < bins; ++i) {
        lines[i] = lines[i] * each + std::max(rest, 0.0);
    }
    return lines;
}

} // namespace paradize::filter
