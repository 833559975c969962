#include "obj/triangulate.hpp"

#include <cmath>

namespace paradize::obj {
namespace {

using Point = Triangulator::Point;

double turn(Point a, Point b, Point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Newell's normal, relative to the first corner so that a large offset costs no digits.
std::array<double, 3> newell(std::span<const std::array<double, 3>> corners) {
    std::array<double, 3> sum{};
    const auto &origin = corners[0];
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        std::array<double, 3> a{}, b{};
        for (std::size_t k = 0; k < 3; ++k) {
            a[k] = corners[i][k] - origin[k];
            b[k] = corners[i + 1][k] - origin[k];
        }
        for (std::size_t k = 0; k < 3; ++k)
            sum[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
    return sum;
}

// Corners in the plane, counter-clockwise seen from the normal's side: dropping one axis keeps coordinates
// exact.
void project(std::span<const std::array<double, 3>> corners, const std::array<double, 3> &normal,
             std::vector<Point> &points) {
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::fabs(normal[k]) > std::fabs(normal[axis]))
            axis = k;
    std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0)
        std::swap(u, v);
    points.resize(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
        points[i] = {corners[i][u], corners[i][v]};
}

// A fan from corner 0 is right when the rays from it turn one way, strictly, and sweep less than half a turn.
bool fan_is_sound(std::span<const Point> points) {
    for (std::size_t i = 1; i + 1 < points.size(); ++i)
        if (!(turn(points[0], points[i], points[i + 1]) > 0) ||
            !(turn(points[0], points[1], points[i + 1]) > 0))
            return false;
    return true;
}

void fan(std::size_t count, std::vector<std::uint32_t> &out) {
    for (std::uint32_t i = 1; i + 1 < count; ++i)
        out.insert(out.end(), {0, i, i + 1});
}

class EarClipper {
  public:
    EarClipper(std::span<const Point> points, std::uint64_t &work, std::vector<std::uint32_t> &next,
               std::vector<std::uint32_t> &previous)
        : points_(points), work_(work), next_(next), previous_(previous) {
        const std::size_t n = points.size();
        next_.resize(n);
        previous_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            next_[i] = static_cast<std::uint32_t>((i + 1) % n);
            previous_[i] = static_cast<std::uint32_t>((i + n - 1) % n);
        }
    }

    Cut run(std::vector<std::uint32_t> &out) {
        Cut result = Cut::sound;
        std::uint32_t at = 0;
        for (std::size_t left = points_.size(); left > 3; --left) {
            Strictness strictness = Strictness::closed;
            std::uint32_t ear = find_ear(at, left, strictness);
            if (ear == none) {
                strictness = Strictness::open;
                ear = find_ear(at, left, strictness);
            }
            if (ear == none || work_ == 0) {
                result = work_ == 0 ? Cut::unchecked : result == Cut::unchecked ? result : Cut::crossing;
                if (ear == none)
                    ear = find_ear(at, left, Strictness::unchecked);
            }
            if (ear == none)
                ear = at;
            out.insert(out.end(), {previous_[ear], ear, next_[ear]});
            next_[previous_[ear]] = next_[ear];
            previous_[next_[ear]] = previous_[ear];
            at = next_[next_[ear]];
        }
        out.insert(out.end(), {previous_[at], at, next_[at]});
        if (result == Cut::sound && turn(points_[previous_[at]], points_[at], points_[next_[at]]) < 0)
            result = Cut::crossing; // what is left lies upside down
        return result;
    }

  private:
    enum class Strictness { closed, open, unchecked };
    static constexpr std::uint32_t none = 0xffffffffu;

    std::uint32_t find_ear(std::uint32_t from, std::size_t left, Strictness strictness) {
        constexpr std::size_t steps_without_work = 64;
        std::uint32_t i = from;
        for (std::size_t k = 0; k < left && (work_ > 0 || k < steps_without_work); ++k, i = next_[i]) {
            work_ -= work_ > 0 ? 1 : 0;
            if (is_ear(i, left, strictness))
                return i;
        }
        return none;
    }

    // closed: no other corner inside or on the ear; open: none strictly inside.
    bool is_ear(std::uint32_t i, std::size_t left, Strictness strictness) {
        const Point a = points_[previous_[i]], b = points_[i], c = points_[next_[i]];
        if (!(turn(a, b, c) > 0))
            return false;
        if (strictness == Strictness::unchecked || work_ < left) {
            work_ = work_ < left ? 0 : work_;
            return true;
        }
        work_ -= left;
        for (std::uint32_t j = next_[next_[i]]; j != previous_[i]; j = next_[j]) {
            const Point p = points_[j];
            if (p == a || p == b || p == c)
                continue;
            const double ab = turn(a, b, p), bc = turn(b, c, p), ca = turn(c, a, p);
            const bool inside =
                strictness == Strictness::closed ? ab >= 0 && bc >= 0 && ca >= 0 : ab > 0 && bc > 0 && ca > 0;
            if (inside)
                return false;
        }
        return true;
    }

    std::span<const Point> points_;
    std::uint64_t &work_;
    std::vector<std::uint32_t> &next_, &previous_;
};

} // namespace

Cut Triangulator::cut(std::span<const std::array<double, 3>> corners, std::uint64_t &work,
                      std::vector<std::uint32_t> &out) {
    if (corners.size() == 3) {
        fan(3, out);
        return Cut::sound;
    }
    const auto normal = newell(corners);
    if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) {
        fan(corners.size(), out);
        return Cut::collinear;
    }
    project(corners, normal, points_);
    if (fan_is_sound(points_)) {
        fan(corners.size(), out);
        return Cut::sound;
    }
    return EarClipper(points_, work, next_, previous_).run(out);
}

} // namespace paradize::obj
