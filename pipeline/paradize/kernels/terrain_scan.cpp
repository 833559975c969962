#include "terrain_scan.hpp"

#include "maps_parallel.hpp"

#include <cmath>
#include <utility>

namespace paradize::terrain {
namespace {

constexpr std::int64_t one = std::int64_t{1} << 32;
// A border meets a row at a whole number or at least 2^-14 beside one; sixteen thousand steps of a slope of
// 32 fractional bits err by less than 2^-17.
constexpr std::int64_t bias = one >> 16;

std::int64_t slope(Spot from, Spot to) { // columns per row, 32 fractional bits; to.y != from.y
    const double dx = static_cast<double>(static_cast<int>(to.x) - static_cast<int>(from.x));
    const double dy = static_cast<double>(static_cast<int>(to.y) - static_cast<int>(from.y));
    return static_cast<std::int64_t>(dx / dy * 4294967296.0);
}

std::int64_t fixed(Spot spot) {
    return static_cast<std::int64_t>(spot.x) << 32;
}

// The largest |row[k] - (base + k * step)| for k in [0, count).
PARADIZE_CLONES double largest(const float *row, int count, double base, double step) {
    typedef double Lanes __attribute__((vector_size(64)));
    typedef float Floats __attribute__((vector_size(32)));
    Lanes most{}, places = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    int k = 0;
    for (; k + 8 <= count; k += 8) {
        Floats heights;
        __builtin_memcpy(&heights, row + k, sizeof heights);
        Lanes off = __builtin_convertvector(heights, Lanes) - (base + places * step);
        off = off < 0.0 ? -off : off;
        most = off > most ? off : most;
        places += 8.0;
    }
    double found = 0.0;
    for (int lane = 0; lane < 8; ++lane) {
        found = most[lane] > found ? most[lane] : found;
    }
    for (; k < count; ++k) {
        const double off = std::fabs(static_cast<double>(row[k]) - (base + static_cast<double>(k) * step));
        found = off > found ? off : found;
    }
    return found;
}

class Scan {
  public:
    Scan(View view, Spot a, Spot b, Spot c, double tolerance, unsigned skipped)
        : view_(view), a_(a), b_(b), c_(c), skipped_(skipped), worst_{tolerance, none} {
        const double z0 = static_cast<double>(view.height(a));
        const double z1 = static_cast<double>(view.height(b)) - z0,
                     z2 = static_cast<double>(view.height(c)) - z0;
        const double x1 = static_cast<int>(b.x) - static_cast<int>(a.x),
                     y1 = static_cast<int>(b.y) - static_cast<int>(a.y);
        const double x2 = static_cast<int>(c.x) - static_cast<int>(a.x),
                     y2 = static_cast<int>(c.y) - static_cast<int>(a.y);
        const double area = x1 * y2 - y1 * x2;
        base_ = z0;
        per_x_ = (z1 * y2 - z2 * y1) / area;
        per_y_ = (z2 * x1 - z1 * x2) / area;
    }

    Worst run() {
        // a is the highest corner, and the left one of two.
        Spot a = a_, b = b_, c = c_;
        while (a.y > b.y || a.y >= c.y) {
            const Spot first = a;
            a = b, b = c, c = first;
        }
        const std::int64_t left = slope(c, a);
        if (b.y <= c.y) { // the right border bends at b
            std::int64_t from = fixed(a) + one - bias;
            if (b.y > a.y) {
                const std::int64_t right = slope(a, b);
                rows(a.y, b.y, from, left, fixed(a) + bias, right);
            }
            from += left * (b.y - a.y);
            rows(b.y, b.y < c.y ? c.y + 1 : b.y + 1, from, left, fixed(b) + bias,
                 b.y < c.y ? slope(b, c) : 0);
        } else { // the left border bends at c
            const std::int64_t right = slope(a, b);
            rows(a.y, c.y, fixed(a) + one - bias, left, fixed(a) + bias, right);
            rows(c.y, b.y + 1, fixed(c) + one - bias, slope(b, c), fixed(a) + bias + right * (c.y - a.y),
                 right);
        }
        return worst_;
    }

  private:
    View view_;
    Spot a_, b_, c_;
    unsigned skipped_;
    double base_, per_x_, per_y_;
    Worst worst_;

    bool counts(Spot spot) const {
        if (spot == a_ || spot == b_ || spot == c_) {
            return false;
        }
        return skipped_ == 0 || (((skipped_ & 1U) == 0 || turn(a_, b_, spot) != 0) &&
                                 ((skipped_ & 2U) == 0 || turn(b_, c_, spot) != 0) &&
                                 ((skipped_ & 4U) == 0 || turn(c_, a_, spot) != 0));
    }

    void rows(int first, int last, std::int64_t from, std::int64_t per_from, std::int64_t to,
              std::int64_t per_to) {
        for (int y = first; y < last; ++y, from += per_from, to += per_to) {
            const int left = static_cast<int>(from >> 32), right = static_cast<int>(to >> 32);
            const float *row = view_.at + static_cast<std::size_t>(y) * view_.stride;
            const double at_row = base_ + per_y_ * static_cast<double>(y - static_cast<int>(a_.y));
            const double start = at_row + per_x_ * static_cast<double>(left - static_cast<int>(a_.x));
            if (right - left >= 16 && largest(row + left, right - left + 1, start, per_x_) <= worst_.error) {
                continue;
            }
            for (int x = left; x <= right; ++x) {
                const double off =
                    std::fabs(static_cast<double>(row[x]) - (start + static_cast<double>(x - left) * per_x_));
                if (off > worst_.error) {
                    const Spot spot{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)};
                    if (counts(spot)) {
                        worst_ = {off, packed(spot)};
                    }
                }
            }
        }
    }
};

} // namespace

Worst scan_triangle(View view, Spot a, Spot b, Spot c, double tolerance, unsigned skipped) {
    return Scan(view, a, b, c, tolerance, skipped).run();
}

} // namespace paradize::terrain
