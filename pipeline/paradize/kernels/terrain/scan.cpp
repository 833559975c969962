#include "terrain/scan.hpp"

#include "simd/cpu.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace paradize::terrain {
namespace {

typedef double Lanes __attribute__((vector_size(64)));
typedef float Floats __attribute__((vector_size(32)));
constexpr int lanes = 8;
constexpr std::int64_t enough = 512; // half the pixels of a large triangle that are looked at first
constexpr int few = 12;              // pixels in a box: as quick one by one

constexpr std::int64_t one = std::int64_t{1} << 32;
// A border meets a row at a whole number or at least 2^-14 beside one; sixteen thousand steps of a slope of
// 32 fractional bits err by less than 2^-17.
constexpr std::int64_t bias = one >> 16;

std::int64_t slope(Pixel from, Pixel to) { // columns per row, 32 fractional bits; to.y != from.y
    const double dx = static_cast<double>(static_cast<int>(to.x) - static_cast<int>(from.x));
    const double dy = static_cast<double>(static_cast<int>(to.y) - static_cast<int>(from.y));
    return static_cast<std::int64_t>(dx / dy * 4294967296.0);
}

std::int64_t fixed(Pixel spot) {
    return static_cast<std::int64_t>(spot.x) << 32;
}

struct Face { // three corners of positive turn, and the plane base + per_x * x + per_y * y from the first on
    Pixel corner[3];
    double base, per_x, per_y;

    Face(View view, Pixel a, Pixel b, Pixel c, double area) : corner{a, b, c} {
        const double z0 = static_cast<double>(view.height(a));
        const double z1 = static_cast<double>(view.height(b)) - z0,
                     z2 = static_cast<double>(view.height(c)) - z0;
        const double x1 = static_cast<int>(b.x) - static_cast<int>(a.x),
                     y1 = static_cast<int>(b.y) - static_cast<int>(a.y);
        const double x2 = static_cast<int>(c.x) - static_cast<int>(a.x),
                     y2 = static_cast<int>(c.y) - static_cast<int>(a.y);
        const double share = 1.0 / area;
        base = z0;
        per_x = (z1 * y2 - z2 * y1) * share;
        per_y = (z2 * x1 - z1 * x2) * share;
    }

    double at(int x, int y) const { // exact in x and y
        return base + per_y * static_cast<double>(y - static_cast<int>(corner[0].y)) +
               per_x * static_cast<double>(x - static_cast<int>(corner[0].x));
    }
};

struct Box {
    int left, top, right, bottom;
};

// Rows [first, last) from the left to the right border: columns with 32 fractional bits, and what they gain a
// row.
struct Run {
    int first, last;
    std::int64_t from, per_from, to, per_to;
};

// The largest error of eight lanes, of equals the first pixel. Without branches: nothing foretells them.
inline __attribute__((always_inline)) Worst reduced(const Lanes &most, const Lanes &where, double tolerance) {
    double top = tolerance;
    for (int lane = 0; lane < lanes; ++lane) {
        top = most[lane] > top ? most[lane] : top;
    }
    if (!(top > tolerance)) {
        return {tolerance, none};
    }
    double first = 4294967296.0;
    for (int lane = 0; lane < lanes; ++lane) {
        const double at = most[lane] == top ? where[lane] : 4294967296.0;
        first = at < first ? at : first;
    }
    return {top, static_cast<std::uint32_t>(first)};
}

// Eight heights from `at` on, as many as there are.
inline __attribute__((always_inline)) void load(const float *at, const float *end, Lanes &heights) {
    Floats read{};
    if (end - at >= lanes) [[likely]] {
        __builtin_memcpy(&read, at, sizeof read);
    } else {
        __builtin_memcpy(&read, at, static_cast<std::size_t>(end - at) * sizeof(float));
    }
    heights = __builtin_convertvector(read, Lanes);
}

// A triangle of at most eight columns: a row of pixels at once, inside where no side has it on its left.
PARADIZE_CLONES Worst scan_narrow(View view, const Face &face, const Box &box, double tolerance) {
    const Lanes places = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    double start[3], across[3], down[3]; // of twice the area that a pixel spans with each side
    for (int k = 0; k < 3; ++k) {
        const Pixel p = face.corner[k], q = face.corner[k == 2 ? 0 : k + 1];
        down[k] = static_cast<int>(q.x) - static_cast<int>(p.x);
        across[k] = static_cast<int>(p.y) - static_cast<int>(q.y);
        start[k] =
            down[k] * (box.top - static_cast<int>(p.y)) + across[k] * (box.left - static_cast<int>(p.x));
    }
    Lanes ab = start[0] + places * across[0], bc = start[1] + places * across[1],
          ca = start[2] + places * across[2];
    const Lanes along = places * face.per_x;
    const Lanes outside = Lanes{} - 1.0;
    Lanes most = Lanes{} + tolerance, where = outside;
    const float *row = view.at + static_cast<std::size_t>(box.top) * view.stride + box.left;
    Lanes pixels = places + static_cast<double>(box.top * 65536.0 + box.left);
    for (int y = box.top; y <= box.bottom; ++y, row += view.stride) {
        Lanes heights;
        load(row, view.end, heights);
        Lanes off = heights - (face.at(box.left, y) + along);
        off = off < 0.0 ? -off : off;
        Lanes least = ab < bc ? ab : bc;
        least = least < ca ? least : ca;
        off = least < 0.0 ? outside : off;
        where = off > most ? pixels : where;
        most = off > most ? off : most;
        ab += down[0];
        bc += down[1];
        ca += down[2];
        pixels += 65536.0;
    }
    return reduced(most, where, tolerance);
}

// Every `step_rows`th row of each run.
PARADIZE_CLONES Worst scan_wide(View view, const Face &face, const Run (&runs)[2], double tolerance,
                                int step_rows) {
    const Lanes places = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    const Lanes along = places * face.per_x;
    const double step = 8.0 * face.per_x;
    const Lanes outside = Lanes{} - 1.0;
    Lanes most = Lanes{} + tolerance, where = outside;
    for (const Run &run : runs) {
        std::int64_t from = run.from, to = run.to;
        const std::int64_t per_from = run.per_from * step_rows, per_to = run.per_to * step_rows;
        for (int y = run.first; y < run.last; y += step_rows, from += per_from, to += per_to) {
            const int left = static_cast<int>(from >> 32), right = static_cast<int>(to >> 32);
            const float *row = view.at + static_cast<std::size_t>(y) * view.stride;
            const double start = face.at(left, y);
            double block = 0.0;
            Lanes pixels = places + static_cast<double>(y * 65536.0 + left);
            for (int x = left; x <= right; x += lanes, block += 1.0, pixels += 8.0) {
                Lanes heights;
                load(row + x, view.end, heights);
                Lanes off = heights - ((start + block * step) + along);
                off = off < 0.0 ? -off : off;
                off = places <= static_cast<double>(right - x) ? off : outside;
                where = off > most ? pixels : where;
                most = off > most ? off : most;
            }
        }
    }
    return reduced(most, where, tolerance);
}

// Pixel by pixel: for small boxes, and where a corner, or a pixel of a skipped side, seems the worst by its
// rounding or because it is.
Worst scan_slowly(View view, const Face &face, const Box &box, double tolerance, unsigned skipped) {
    Worst worst{tolerance, none};
    for (int y = box.top; y <= box.bottom; ++y) {
        for (int x = box.left; x <= box.right; ++x) {
            const Pixel spot{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)};
            const double off = std::fabs(static_cast<double>(view.height(spot)) - face.at(x, y));
            if (!(off > worst.error)) {
                continue;
            }
            bool counts = true;
            for (unsigned k = 0; k < 3; ++k) {
                const std::int64_t side = turn(face.corner[k], face.corner[(k + 1) % 3], spot);
                counts = counts && !(spot == face.corner[k]) && side >= 0 &&
                         (side > 0 || (skipped >> k & 1U) == 0);
            }
            if (counts) {
                worst = {off, packed(spot)};
            }
        }
    }
    return worst;
}

// a is the highest corner, and the left one of two.
Worst scan_runs(View view, const Face &face, double tolerance, int step_rows) {
    Pixel a = face.corner[0], b = face.corner[1], c = face.corner[2];
    while (a.y > b.y || a.y >= c.y) {
        const Pixel first = a;
        a = b, b = c, c = first;
    }
    const std::int64_t left = slope(c, a), start = fixed(a) + one - bias;
    if (b.y <= c.y) { // the right border bends at b
        return scan_wide(
            view, face,
            {{a.y, b.y, start, left, fixed(a) + bias, b.y > a.y ? slope(a, b) : 0},
             {b.y, c.y + 1, start + left * (b.y - a.y), left, fixed(b) + bias, b.y < c.y ? slope(b, c) : 0}},
            tolerance, step_rows);
    }
    const std::int64_t right = slope(a, b);
    return scan_wide(
        view, face,
        {{a.y, c.y, start, left, fixed(a) + bias, right},
         {c.y, b.y + 1, fixed(c) + one - bias, slope(b, c), fixed(a) + bias + right * (c.y - a.y), right}},
        tolerance, step_rows);
}

} // namespace

Worst scan_triangle(View view, Pixel a, Pixel b, Pixel c, double tolerance, unsigned skipped) {
    const std::int64_t area = turn(a, b, c);
    if (area == 1) {
        return {tolerance, none}; // three pixels in all
    }
    const Face face(view, a, b, c, static_cast<double>(area));
    const Box box{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::max({a.x, b.x, c.x}),
                  std::max({a.y, b.y, c.y})};
    if ((box.right - box.left + 1) * (box.bottom - box.top + 1) <= few) {
        return scan_slowly(view, face, box, tolerance, skipped);
    }
    Worst worst{tolerance, none};
    if (box.right - box.left < lanes) {
        worst = scan_narrow(view, face, box, tolerance);
    } else {
        const std::int64_t step = std::min<std::int64_t>(area / enough, (box.bottom - box.top) / 8);
        if (step > 1) {
            worst = scan_runs(view, face, tolerance, static_cast<int>(step));
        }
        if (worst.pixel == none) {
            worst = scan_runs(view, face, tolerance, 1);
        }
    }
    if (worst.pixel == none) {
        return worst;
    }
    const Pixel spot = unpacked(worst.pixel);
    bool counts = !(spot == a) && !(spot == b) && !(spot == c);
    counts = counts && ((skipped & 1U) == 0 || turn(a, b, spot) != 0) &&
             ((skipped & 2U) == 0 || turn(b, c, spot) != 0) && ((skipped & 4U) == 0 || turn(c, a, spot) != 0);
    return counts ? worst : scan_slowly(view, face, box, tolerance, skipped);
}

} // namespace paradize::terrain
