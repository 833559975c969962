#include "reference/atlas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace paradize::reference {

namespace {

// Of the image's side: float32 coordinates near 1 lie 6e-8 apart, so that of a triangle thinner than this
// nobody can say which way it turns.
constexpr double thinnest = 1.0 / (1 << 22);

struct Side {
    std::uint32_t low, high, triangle, corner; // corner k to k + 1
    bool turned;
};

// All edges, those of the same two places beside each other.
std::vector<Side> sides_of(const Layout &layout) {
    std::vector<Side> sides;
    sides.reserve(layout.triangles.size());
    for (std::uint32_t t = 0; t < layout.triangles.size() / 3; ++t) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = layout.triangles[3 * std::size_t{t} + k];
            const std::uint32_t b = layout.triangles[3 * std::size_t{t} + (k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), t, k, a > b});
        }
    }
    std::ranges::sort(sides, [](const Side &x, const Side &y) {
        if (x.low != y.low || x.high != y.high) {
            return x.low != y.low ? x.low < y.low : x.high < y.high;
        }
        return x.triangle < y.triangle;
    });
    return sides;
}

// The image of a side from its lower place to its higher one.
std::array<double, 4> image_of(const Layout &layout, const Side &side) {
    const double *a = layout.corners.data() + 6 * std::size_t{side.triangle} + 2 * side.corner;
    const double *b = layout.corners.data() + 6 * std::size_t{side.triangle} + 2 * ((side.corner + 1) % 3);
    if (side.turned) {
        std::swap(a, b);
    }
    return {a[0], a[1], b[0], b[1]};
}

// Calls use(one, other, same image) for every two triangles that meet in an edge one after the other.
template <typename Use>
void for_pairs(const Layout &layout, const std::vector<Side> &sides, Use &&use) {
    for (std::size_t i = 1; i < sides.size(); ++i) {
        const Side &a = sides[i - 1], &b = sides[i];
        if (a.low != b.low || a.high != b.high) {
            continue;
        }
        const auto p = image_of(layout, a), q = image_of(layout, b);
        bool same = true;
        for (std::size_t k = 0; k < 4; ++k) {
            same = same && std::abs(p[k] - q[k]) < 1e-6;
        }
        use(a, b, same);
    }
}

std::uint32_t root_of(std::vector<std::uint32_t> &parent, std::uint32_t at) {
    while (parent[at] != at) {
        at = parent[at] = parent[parent[at]];
    }
    return at;
}

double image_area(const double *p) {
    return ((p[2] - p[0]) * (p[5] - p[1]) - (p[4] - p[0]) * (p[3] - p[1])) / 2;
}

// The smallest height of a triangle with corners of `size` numbers.
double thickness(double area, std::array<const double *, 3> p, std::size_t size) {
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        double square = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const double side = p[k][i] - p[(k + 1) % 3][i];
            square += side * side;
        }
        longest = std::max(longest, std::sqrt(square));
    }
    return longest > 0 ? 2 * std::abs(area) / longest : 0;
}

} // namespace

std::vector<std::int32_t> charts_of(const Layout &layout) {
    std::vector<std::uint32_t> parent(layout.triangles.size() / 3);
    std::iota(parent.begin(), parent.end(), 0U);
    for_pairs(layout, sides_of(layout), [&](const Side &a, const Side &b, bool same) {
        if (same) {
            const std::uint32_t x = root_of(parent, a.triangle), y = root_of(parent, b.triangle);
            parent[std::max(x, y)] = std::min(x, y);
        }
    });
    std::vector<std::int32_t> chart(parent.size(), -1);
    std::int32_t count = 0;
    for (std::uint32_t t = 0; t < parent.size(); ++t) {
        const std::uint32_t root = root_of(parent, t); // the smallest of its set: named before the others
        chart[t] = root == t ? count++ : chart[root];
    }
    return chart;
}

LayoutQuality layout_quality(const Layout &layout) {
    LayoutQuality out;
    const std::size_t count = layout.triangles.size() / 3;
    double surface = 0, image = 0, turned = 0, squares = 0;
    std::vector<double> areas(count), thick(count);
    for (std::size_t t = 0; t < count; ++t) {
        const double *p[3];
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = layout.positions.data() + 3 * std::size_t{layout.triangles[3 * t + k]};
        }
        double n = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
            const double value =
                (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
            n += value * value;
        }
        areas[t] = std::sqrt(n) / 2;
        thick[t] = thickness(areas[t], {p[0], p[1], p[2]}, 3);
        const double there = image_area(layout.corners.data() + 6 * t);
        turned += there;
        image += std::abs(there);
        surface += areas[t];
    }
    const double filled = surface > 0 ? 1 / std::sqrt(surface) : 0; // the scale of a layout without gaps
    double measured = 0;
    for (std::size_t t = 0; t < count; ++t) {
        const double *uv = layout.corners.data() + 6 * t;
        const double there = image_area(uv);
        if (there * turned < 0 && thickness(there, {uv, uv + 2, uv + 4}, 2) > thinnest) {
            ++out.flipped;
        }
        if (!(thick[t] * filled > thinnest)) {
            continue;
        }
        if (there == 0) {
            ++out.without;
            continue;
        }
        // The surface's point as a linear function of the image's: its two derivatives' squares.
        const double *p[3];
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = layout.positions.data() + 3 * std::size_t{layout.triangles[3 * t + k]};
        }
        const double u1 = uv[2] - uv[0], v1 = uv[3] - uv[1], u2 = uv[4] - uv[0], v2 = uv[5] - uv[1];
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double a = p[1][k] - p[0][k], b = p[2][k] - p[0][k];
            const double du = (a * v2 - b * v1) / (2 * there), dv = (b * u1 - a * u2) / (2 * there);
            sum += du * du + dv * dv;
        }
        squares += areas[t] * sum / 2;
        measured += areas[t];
        out.density.push_back(std::sqrt(std::abs(there) / areas[t]));
    }
    for_pairs(layout, sides_of(layout), [&](const Side &a, const Side &, bool same) {
        if (same) {
            return;
        }
        const double *p = layout.positions.data() + 3 * std::size_t{a.low};
        const double *q = layout.positions.data() + 3 * std::size_t{a.high};
        const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
        out.seam_length += std::sqrt(x * x + y * y + z * z);
    });
    out.packing = image;
    if (surface > 0) {
        out.stretch = measured > 0 ? std::sqrt(squares / measured * image / surface) : 0;
        out.seam_length /= std::sqrt(surface);
    }
    const auto chart = charts_of(layout);
    out.charts = static_cast<std::uint32_t>(*std::ranges::max_element(chart)) + 1;
    return out;
}

LayoutRaster layout_raster(std::span<const double> corners, std::span<const std::int32_t> chart,
                           std::uint32_t resolution, std::uint32_t gap) {
    constexpr std::int32_t none = -1, many = -2;
    const auto side = static_cast<std::int64_t>(resolution);
    const std::size_t texels = std::size_t{resolution} * resolution;
    std::vector<std::uint8_t> times(texels, 0);
    std::vector<std::int32_t> touched(texels, none);
    LayoutRaster out;
    for (std::size_t t = 0; t < chart.size(); ++t) {
        std::array<double, 6> p{};
        for (std::size_t k = 0; k < 6; ++k) {
            p[k] = corners[6 * t + k] * static_cast<double>(resolution);
        }
        const double turn = image_area(p.data()) < 0 ? -1.0 : 1.0;
        std::array<std::array<double, 3>, 3> edges{}; // signed distance a x + b y + c, positive inside
        bool flat = false;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t l = (k + 1) % 3;
            const double dx = p[2 * l] - p[2 * k], dy = p[2 * l + 1] - p[2 * k + 1];
            const double length = std::sqrt(dx * dx + dy * dy);
            flat = flat || !(length > 0);
            const double a = flat ? 0 : -turn * dy / length, b = flat ? 0 : turn * dx / length;
            edges[k] = {a, b, -(a * p[2 * k] + b * p[2 * k + 1])};
        }
        const auto [left, right] = std::minmax({p[0], p[2], p[4]});
        const auto [top, bottom] = std::minmax({p[1], p[3], p[5]});
        const auto clamp = [&](double v) {
            return std::clamp(static_cast<std::int64_t>(std::floor(v)), std::int64_t{0}, side - 1);
        };
        for (std::int64_t y = clamp(top + 1e-3); y <= clamp(bottom - 1e-3); ++y) {
            for (std::int64_t x = clamp(left + 1e-3); x <= clamp(right - 1e-3); ++x) {
                double nearest = 1e9;
                bool outside = false;
                for (const auto &[a, b, c] : edges) {
                    const double here =
                        a * (static_cast<double>(x) + 0.5) + b * (static_cast<double>(y) + 0.5) + c;
                    nearest = std::min(nearest, here);
                    outside = outside || here < -(std::abs(a) + std::abs(b)) / 2 + 1e-3;
                }
                const auto at = static_cast<std::size_t>(y * side + x);
                if (!flat && nearest > 1e-3) {
                    times[at] = static_cast<std::uint8_t>(std::min(2, times[at] + 1));
                }
                if (!outside) {
                    touched[at] = touched[at] == none || touched[at] == chart[t] ? chart[t] : many;
                }
            }
        }
    }
    for (const std::uint8_t n : times) {
        out.covered += n > 0 ? 1 : 0;
        out.twice += n > 1 ? 1 : 0;
    }
    // Rows first: what lies within `gap` to the right; then columns, down and up. A pair is seen from one
    // side.
    const auto both = [&](std::int32_t a, std::int32_t b) {
        return a == none || a == b ? b : b == none ? a : many;
    };
    const auto reach = static_cast<std::int64_t>(gap);
    std::vector<std::int32_t> wide(texels, none);
    for (std::int64_t y = 0; y < side; ++y) {
        for (std::int64_t x = 0; x < side; ++x) {
            std::int32_t found = none;
            for (std::int64_t d = std::max(x - reach, std::int64_t{0}); d <= std::min(x + reach, side - 1);
                 ++d) {
                found = both(found, touched[static_cast<std::size_t>(y * side + d)]);
            }
            wide[static_cast<std::size_t>(y * side + x)] = found;
        }
    }
    for (std::int64_t y = 0; y < side; ++y) {
        for (std::int64_t x = 0; x < side; ++x) {
            std::int32_t found = touched[static_cast<std::size_t>(y * side + x)];
            if (found == none) {
                continue;
            }
            for (std::int64_t d = std::max(y - reach, std::int64_t{0}); d <= std::min(y + reach, side - 1);
                 ++d) {
                found = both(found, wide[static_cast<std::size_t>(d * side + x)]);
            }
            out.near += found == many ? 1 : 0;
        }
    }
    return out;
}

} // namespace paradize::reference
