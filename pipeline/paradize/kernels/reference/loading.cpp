#include "reference/loading.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "math/functions.hpp"
#include "reference/samples.hpp"

namespace paradize::reference {
namespace {

constexpr double half_ulp = 0x1p-53; // of a float64, relative
constexpr double turned_share = 0.99;

// text - (origin + position) with one rounding: the difference to the origin is split into what float64 holds
// and the rest (O. Moller, "Quasi Double-Precision in Floating Point Addition", 1965).
double lost(double text, double origin, double position) {
    const double sum = text - origin, back = sum - text;
    const double rest = (text - (sum - back)) - (origin + back);
    return sum - position + rest;
}

// Twice a triangle's area as a vector, of edges that are divided by `size`.
Point doubled_area(const Corners &c, double size) {
    Point a = minus(c[1], c[0]), b = minus(c[2], c[0]);
    for (std::size_t k = 0; k < 3; ++k) {
        a[k] /= size;
        b[k] /= size;
    }
    return cross(a, b);
}

double largest_edge(const Corners &c) {
    double most = 0;
    for (std::size_t k = 0; k < 3; ++k)
        most = std::max({most, std::fabs(c[1][k] - c[0][k]), std::fabs(c[2][k] - c[0][k])});
    return most;
}

double reach_of(const Corners &c) {
    double most = 0;
    for (const Point &p : c)
        for (const double value : p)
            most = std::max(most, std::fabs(value));
    return most;
}

} // namespace

Loading loading(std::span<const float> positions, std::span<const double> origin,
                std::span<const double> texts, std::span<const std::uint32_t> triangles) {
    Loading out;
    const std::size_t count = triangles.size() / 3;
    std::vector<double> turned(count), area(count);
    for (std::size_t k = 0; k < 3; ++k)
        out.low[k] = out.high[k] = texts[triangles[0] * std::size_t{3} + k];
    for (std::size_t i = 0; i < count; ++i) {
        Corners text, loaded;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            double off[3] = {};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t at = triangles[i * 3 + corner] * std::size_t{3} + k;
                text[corner][k] = texts[at];
                loaded[corner][k] = positions[at];
                off[k] = lost(texts[at], origin[k], loaded[corner][k]);
                out.low[k] = std::min(out.low[k], texts[at]);
                out.high[k] = std::max(out.high[k], texts[at]);
            }
            out.max = std::max(out.max, std::sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]));
        }
        const double size = largest_edge(text);
        if (!(size > 0))
            continue;
        const Point truth = doubled_area(text, size);
        const double whole = std::sqrt(dot(truth, truth));
        if (!(whole > 8 * half_ulp * reach_of(text) / size))
            continue;
        const double own = largest_edge(loaded);
        const Point now = own > 0 ? doubled_area(loaded, own) : Point{};
        const Point across = cross(truth, now);
        area[i] = whole * size * size;
        turned[i] = mathx::atan2(std::sqrt(dot(across, across)), dot(truth, now)) * (180 / mathx::pi);
        if (dot(now, now) == 0) {
            turned[i] = 90;
            if (out.collapsed++ == 0)
                out.first = static_cast<std::uint32_t>(i);
        }
    }
    out.turned_p99_deg = quantile(turned, turned_share, [&](std::size_t i) { return area[i]; });
    return out;
}

} // namespace paradize::reference
