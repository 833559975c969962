#include "reference/flip.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "math/functions.hpp"

namespace paradize::reference {
namespace {

constexpr double pixels_per_degree = 3840.0 * mathx::pi / 180; // of a picture as wide as it is away
constexpr double color_exponent = 0.7, feature_exponent = 0.5;
constexpr double knee = 0.4, below_knee = 0.95; // of the largest colour difference; what it is mapped to
constexpr double feature_width = 0.082;         // degrees
constexpr std::size_t feature_radius = 9;       // three standard deviations

using Plane = std::vector<float>;
using FilterTaps = std::vector<float>; // of an odd number of pixels
using Color = std::array<double, 3>;

struct PictureSize {
    std::size_t rows, columns;
};

// Sums of a plane's neighbours along its rows, or along its columns.
void across(const Plane &in, PictureSize size, const FilterTaps &taps, Plane &out) {
    const std::size_t radius = taps.size() / 2, columns = size.columns;
    out.resize(in.size());
    std::vector<float> padded(columns + 2 * radius);
    for (std::size_t y = 0; y < size.rows; ++y) {
        const float *row = &in[y * columns];
        std::fill_n(padded.begin(), radius, row[0]);
        std::copy_n(row, columns, padded.begin() + static_cast<std::ptrdiff_t>(radius));
        std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(radius), radius, row[columns - 1]);
        float *to = &out[y * columns];
        std::fill_n(to, columns, 0.0F);
        for (std::size_t k = 0; k < taps.size(); ++k) {
            const float tap = taps[k], *from = &padded[k];
            for (std::size_t x = 0; x < columns; ++x) {
                to[x] += tap * from[x];
            }
        }
    }
}

void down(const Plane &in, PictureSize size, const FilterTaps &taps, float weight, Plane &out) {
    const std::size_t radius = taps.size() / 2, columns = size.columns;
    out.resize(in.size());
    for (std::size_t y = 0; y < size.rows; ++y) {
        float *to = &out[y * columns];
        for (std::size_t k = 0; k < taps.size(); ++k) {
            const std::size_t row = std::clamp(y + k, radius, size.rows - 1 + radius) - radius;
            const float tap = weight * taps[k], *from = &in[row * columns];
            for (std::size_t x = 0; x < columns; ++x) {
                to[x] += tap * from[x];
            }
        }
    }
}

// exp(-x^2 * steepness), as far as it is larger than a millionth.
FilterTaps gaussian(double steepness, std::size_t radius) {
    FilterTaps out;
    double sum = 0;
    for (std::size_t k = 0; k <= 2 * radius; ++k) {
        const double x = static_cast<double>(k) - static_cast<double>(radius);
        sum += mathx::exp(-x * x * steepness);
    }
    for (std::size_t k = 0; k <= 2 * radius; ++k) {
        const double x = static_cast<double>(k) - static_cast<double>(radius);
        out.push_back(static_cast<float>(mathx::exp(-x * x * steepness) / sum));
    }
    return out;
}

// A sum of two-dimensional Gaussians that is 1 altogether.
struct Sensitivity {
    std::vector<std::pair<float, FilterTaps>> parts;
};

// pairs: height and width of each Gaussian of the frequency, degrees squared; as the paper's table 1.
Sensitivity sensitivity(std::initializer_list<std::pair<double, double>> pairs) {
    Sensitivity out;
    double whole = 0;
    std::vector<double> shares;
    for (const auto &[height, width] : pairs) {
        const double steepness = mathx::pi * mathx::pi / (width * pixels_per_degree * pixels_per_degree);
        double sum = 0;
        for (int x = -10; x <= 10; ++x) {
            sum += mathx::exp(-x * x * steepness);
        }
        shares.push_back(height * std::sqrt(mathx::pi / width) * sum * sum);
        whole += shares.back();
        // As wide as the paper's filters, which all have the radius of the widest, unless nothing is there.
        const std::size_t radius =
            std::min<std::size_t>(10, static_cast<std::size_t>(std::sqrt(14 / steepness)) + 1);
        out.parts.emplace_back(0.0F, gaussian(steepness, radius));
    }
    for (std::size_t k = 0; k < shares.size(); ++k) {
        out.parts[k].first = static_cast<float>(shares[k] / whole);
    }
    return out;
}

// Of the Gaussian's derivatives: positive taps add up to 1 and negative ones to -1.
struct Detectors {
    FilterTaps smooth, edge, point;
};

Detectors detectors() {
    const double width = 0.5 * feature_width * pixels_per_degree;
    const double steepness = 0.5 / (width * width);
    Detectors out{gaussian(steepness, feature_radius), {}, {}};
    const auto derivative = [&](auto &&of) {
        double positive = 0, negative = 0;
        std::vector<double> values;
        for (std::size_t k = 0; k <= 2 * feature_radius; ++k) {
            const double x = static_cast<double>(k) - static_cast<double>(feature_radius);
            values.push_back(of(x) * mathx::exp(-x * x * steepness));
            (values.back() > 0 ? positive : negative) += std::abs(values.back());
        }
        FilterTaps taps;
        for (const double value : values) {
            taps.push_back(static_cast<float>(value / (value > 0 ? positive : negative)));
        }
        return taps;
    };
    out.edge = derivative([](double x) { return -x; });
    out.point = derivative([&](double x) { return x * x / (width * width) - 1; });
    return out;
}

struct Filters {
    Sensitivity light = sensitivity({{1, 0.0047}});
    Sensitivity red_green = sensitivity({{1, 0.0053}});
    Sensitivity blue_yellow = sensitivity({{34.1, 0.04}, {13.5, 0.025}});
    Detectors detect = detectors();
    std::array<float, 256> linear{};

    Filters() {
        for (std::size_t k = 0; k < 256; ++k) {
            linear[k] = static_cast<float>(mathx::srgb_to_linear(static_cast<double>(k) / 255));
        }
    }
};

// Linear sRGB to XYZ, and back. IEC 61966-2-1.
constexpr std::array<Color, 3> to_xyz{
    Color{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};

constexpr Color times(const std::array<Color, 3> &m, const Color &v) {
    Color out{};
    for (std::size_t k = 0; k < 3; ++k) {
        out[k] = m[k][0] * v[0] + m[k][1] * v[1] + m[k][2] * v[2];
    }
    return out;
}

constexpr std::array<Color, 3> inverse(const std::array<Color, 3> &m) {
    const auto minor = [&](std::size_t r, std::size_t c) {
        const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    const double det = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
    std::array<Color, 3> out{};
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            out[c][r] = minor(r, c) / det;
        }
    }
    return out;
}

constexpr std::array<Color, 3> to_rgb = inverse(to_xyz);
constexpr Color white = times(to_xyz, {1, 1, 1});

// CIELAB of linear RGB with Hunt's adjustment: colours count less where it is dark.
Color perceived(const Color &rgb) {
    const Color xyz = times(to_xyz, rgb);
    Color f{};
    for (std::size_t k = 0; k < 3; ++k) {
        constexpr double delta = 6.0 / 29;
        const double t = xyz[k] / white[k];
        f[k] = t > delta * delta * delta ? mathx::pow(t, 1.0 / 3) : t / (3 * delta * delta) + 4.0 / 29;
    }
    const double light = 116 * f[1] - 16;
    return {light, 0.01 * light * 500 * (f[0] - f[1]), 0.01 * light * 200 * (f[1] - f[2])};
}

// HyAB: S. Abasi, M. A. Tehran, M. D. Fairchild, "Distance metrics for very large color differences", 2020.
double distance(const Color &a, const Color &b) {
    const double red_green = a[1] - b[1], blue_yellow = a[2] - b[2];
    return std::abs(a[0] - b[0]) + std::sqrt(red_green * red_green + blue_yellow * blue_yellow);
}

// A picture in the space of the filters: luminance, and the opponent colours X - Y and Y - Z as shares of
// white's, which are the paper's Y, Cx and Cz without factors and offset.
struct Seen {
    std::array<Plane, 3> filtered;
    Plane edge, point;

    Color rgb(std::size_t at) const {
        const double y = filtered[0][at], x = y + filtered[1][at], z = y - filtered[2][at];
        Color out = times(to_rgb, {x * white[0], y * white[1], z * white[2]});
        for (double &value : out) {
            value = std::clamp(value, 0.0, 1.0);
        }
        return out;
    }
};

Seen seen(std::span<const std::uint8_t> picture, PictureSize size, const Filters &filters) {
    const std::size_t count = size.rows * size.columns;
    std::array<Plane, 3> planes{Plane(count), Plane(count), Plane(count)};
    for (std::size_t k = 0; k < count; ++k) {
        const auto code = [&](std::size_t c) {
            return static_cast<double>(filters.linear[picture[3 * k + c]]);
        };
        const Color xyz = times(to_xyz, {code(0), code(1), code(2)});
        const double x = xyz[0] / white[0], y = xyz[1] / white[1], z = xyz[2] / white[2];
        planes[0][k] = static_cast<float>(y);
        planes[1][k] = static_cast<float>(x - y);
        planes[2][k] = static_cast<float>(y - z);
    }
    Seen out;
    Plane middle;
    const Sensitivity *kinds[3] = {&filters.light, &filters.red_green, &filters.blue_yellow};
    for (std::size_t c = 0; c < 3; ++c) {
        out.filtered[c].assign(count, 0);
        for (const auto &[weight, taps] : kinds[c]->parts) {
            across(planes[c], size, taps, middle);
            down(middle, size, taps, weight, out.filtered[c]);
        }
    }
    const auto length = [&](const FilterTaps &derivative) {
        Plane x(count, 0), y(count, 0);
        across(planes[0], size, derivative, middle);
        down(middle, size, filters.detect.smooth, 1, x);
        across(planes[0], size, filters.detect.smooth, middle);
        down(middle, size, derivative, 1, y);
        for (std::size_t k = 0; k < count; ++k) {
            x[k] = std::sqrt(x[k] * x[k] + y[k] * y[k]);
        }
        return x;
    };
    out.edge = length(filters.detect.edge);
    out.point = length(filters.detect.point);
    return out;
}

} // namespace

std::vector<float> flip(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, std::size_t rows,
                        std::size_t columns) {
    static const Filters filters;
    static const double most =
        mathx::pow(distance(perceived({0, 1, 0}), perceived({0, 0, 1})), color_exponent);
    const PictureSize size{rows, columns};
    const Seen first = seen(a, size, filters), second = seen(b, size, filters);
    std::vector<float> out(rows * columns, 0);
    for (std::size_t k = 0; k < out.size(); ++k) {
        const auto same = [&](std::size_t c) { return first.filtered[c][k] == second.filtered[c][k]; };
        if (same(0) && same(1) && same(2)) {
            continue;
        }
        const double apart =
            mathx::pow(distance(perceived(first.rgb(k)), perceived(second.rgb(k))), color_exponent);
        const double at = knee * most;
        const double color =
            apart < at ? below_knee / at * apart : below_knee + (apart - at) / (most - at) * (1 - below_knee);
        const double edge = std::abs(static_cast<double>(first.edge[k]) - second.edge[k]);
        const double point = std::abs(static_cast<double>(first.point[k]) - second.point[k]);
        const double feature = mathx::pow(std::max(edge, point) / std::sqrt(2.0), feature_exponent);
        out[k] = color > 0 ? static_cast<float>(std::clamp(mathx::pow(color, 1 - feature), 0.0, 1.0)) : 0.0F;
    }
    return out;
}

} // namespace paradize::reference
