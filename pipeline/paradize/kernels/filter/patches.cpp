#include "filter/patches.hpp"

#include <algorithm>

#include "filter/fft.hpp"
#include "math/functions.hpp"

namespace paradize::filter {
namespace {

constexpr std::size_t largest_patch = 128;
constexpr std::size_t patches_per_axis = 4;
constexpr std::size_t batch = 2 * lanes; // real patches of one transform

std::size_t patch_size(std::size_t n, std::size_t limit) {
    if (n < 4) {
        return 1;
    }
    std::size_t size = 4;
    while (2 * size <= std::min(n, limit)) {
        size *= 2;
    }
    return size;
}

std::vector<std::size_t> places(std::size_t n, std::size_t size) {
    const std::size_t half = std::max<std::size_t>(size / 2, 1);
    const std::size_t count = std::min(patches_per_axis, 1 + (n - size + half - 1) / half);
    std::vector<std::size_t> at(count, 0);
    for (std::size_t i = 1; i < count; ++i) {
        at[i] = (n - size) * i / (count - 1);
    }
    return at;
}

bool on_one_island(const Map &map, const Patches &patches, const Patch &patch) {
    if (map.islands.empty()) {
        return true;
    }
    const std::int32_t id = map.islands[patch.y * map.columns + patch.x];
    for (std::size_t y = 0; y < patches.height; ++y) {
        const auto row =
            map.islands.begin() + static_cast<std::ptrdiff_t>((patch.y + y) * map.columns + patch.x);
        if (!std::all_of(row, row + static_cast<std::ptrdiff_t>(patches.width),
                         [id](std::int32_t other) { return other == id; })) {
            return false;
        }
    }
    return id >= 0;
}

// Centred coordinates of one axis, their squares less the mean, and a window whose spectrum falls
// off fast (Hann's, squared).
struct Axis {
    std::vector<double> u;
    std::vector<double> q;
    std::vector<double> window;
    double uu = 0.0;
    double qq = 0.0;
    double power = 0.0; // sum of the window's squares

    explicit Axis(std::size_t n) : u(n), q(n), window(n, 1.0) {
        const auto count = static_cast<double>(n);
        double mean = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            u[i] = static_cast<double>(i) - (count - 1.0) / 2.0;
            mean += u[i] * u[i] / count;
            if (n > 1) {
                const double s = mathx::sin(mathx::pi * (static_cast<double>(i) + 0.5) / count);
                window[i] = s * s * s * s;
            }
        }
        for (std::size_t i = 0; i < n; ++i) {
            q[i] = u[i] * u[i] - mean;
            uu += u[i] * u[i];
            qq += q[i] * q[i];
            power += window[i] * window[i];
        }
    }
};

// The patch less its least-squares quadratic, windowed, into one real part of each sample.
void load(const Map &map, const Patches &patches, const Patch &patch, const Axis &along_y,
          const Axis &along_x, double *to) {
    const std::size_t rows = patches.height;
    const std::size_t columns = patches.width;
    const auto area = static_cast<double>(rows * columns);
    const double base = map.heights[patch.y * map.columns + patch.x];
    double sum = 0.0;
    double sx = 0.0;
    double sy = 0.0;
    double sxx = 0.0;
    double sxy = 0.0;
    double syy = 0.0;
    for (std::size_t y = 0; y < rows; ++y) {
        const float *row = &map.heights[(patch.y + y) * map.columns + patch.x];
        double r = 0.0;
        double ru = 0.0;
        double rq = 0.0;
        for (std::size_t x = 0; x < columns; ++x) {
            const double h = row[x] - base;
            r += h;
            ru += h * along_x.u[x];
            rq += h * along_x.q[x];
        }
        sum += r;
        sx += ru;
        sxx += rq;
        sy += r * along_y.u[y];
        syy += r * along_y.q[y];
        sxy += ru * along_y.u[y];
    }
    const auto over = [](double a, double b) { return b > 0.0 ? a / b : 0.0; };
    const auto height = static_cast<double>(rows);
    const auto width = static_cast<double>(columns);
    const double mean = base + sum / area;
    sx = over(sx, along_x.uu * height);
    sy = over(sy, along_y.uu * width);
    sxx = over(sxx, along_x.qq * height);
    syy = over(syy, along_y.qq * width);
    sxy = over(sxy, along_x.uu * along_y.uu);
    for (std::size_t y = 0; y < rows; ++y) {
        const float *row = &map.heights[(patch.y + y) * map.columns + patch.x];
        const double v = along_y.u[y];
        const double level = mean + sy * v + syy * along_y.q[y];
        for (std::size_t x = 0; x < columns; ++x) {
            const double fit = level + (sx + sxy * v) * along_x.u[x] + sxx * along_x.q[x];
            to[(y * columns + x) * element] = (row[x] - fit) * along_x.window[x] * along_y.window[y];
        }
    }
}

} // namespace

Patches patches_of(const Map &map) {
    for (std::size_t limit = largest_patch; limit >= 8; limit /= 2) {
        Patches patches{patch_size(map.rows, limit), patch_size(map.columns, limit), {}};
        for (const std::size_t y : places(map.rows, patches.height)) {
            for (const std::size_t x : places(map.columns, patches.width)) {
                if (on_one_island(map, patches, {y, x})) {
                    patches.at.push_back({y, x});
                }
            }
        }
        if (!patches.at.empty()) {
            return patches;
        }
    }
    return {};
}

std::vector<double> power_spectrum(const Map &map, const Patches &patches) {
    const std::size_t rows = patches.height;
    const std::size_t columns = patches.width;
    const std::size_t bins = rows * columns;
    const Axis along_y(rows);
    const Axis along_x(columns);
    const Fft fft_x(columns);
    const Fft fft_y(rows);
    std::vector<double> data(bins * element);
    std::vector<double> line(rows * element);
    std::vector<double> scratch(std::max(rows, columns) * element);
    std::vector<double> power(bins, 0.0);
    for (std::size_t first = 0; first < patches.at.size(); first += batch) {
        const std::size_t used = std::min(batch, patches.at.size() - first);
        if (used < batch) {
            std::fill(data.begin(), data.end(), 0.0);
        }
        for (std::size_t i = 0; i < used; ++i) {
            load(map, patches, patches.at[first + i], along_y, along_x, data.data() + i);
        }
        for (std::size_t y = 0; y < rows; ++y) {
            fft_x.forward(data.data() + y * columns * element, scratch.data());
        }
        for (std::size_t x = 0; x < columns; ++x) {
            for (std::size_t y = 0; y < rows; ++y) {
                const double *from = &data[(y * columns + x) * element];
                std::copy(from, from + element, &line[y * element]);
            }
            fft_y.forward(line.data(), scratch.data());
            for (std::size_t y = 0; y < rows; ++y) {
                double sum = 0.0;
                for (std::size_t l = 0; l < element; ++l) {
                    sum += line[y * element + l] * line[y * element + l];
                }
                power[y * columns + x] += sum; // of two real patches in one signal: halves at k and at -k
            }
        }
    }
    std::vector<double> mean(bins);
    const double scale = 0.5 / (static_cast<double>(patches.at.size()) * along_y.power * along_x.power);
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            const std::size_t mirror = (rows - y) % rows * columns + (columns - x) % columns;
            mean[y * columns + x] = (power[y * columns + x] + power[mirror]) * scale;
        }
    }
    return mean;
}

} // namespace paradize::filter
