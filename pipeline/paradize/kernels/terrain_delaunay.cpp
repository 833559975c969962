#include "terrain_delaunay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace paradize::terrain {
namespace {

__extension__ typedef __int128 Wide; // incircle of 15-bit coordinates needs 66 bits

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

struct Point {
    std::int64_t x, y;
};

// Positive when a, b, c turn the way of every triangle here.
std::int64_t turn(Point a, Point b, Point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Positive when d lies inside the circle through a, b, c (which turn positively).
bool in_circle(Point a, Point b, Point c, Point d) {
    const std::int64_t ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y, cx = c.x - d.x,
                       cy = c.y - d.y;
    const std::int64_t a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
    const Wide sum = static_cast<Wide>(a2) * (bx * cy - by * cx) -
                     static_cast<Wide>(b2) * (ax * cy - ay * cx) +
                     static_cast<Wide>(c2) * (ax * by - ay * bx);
    return sum > 0;
}

std::int64_t floor_div(std::int64_t a, std::int64_t b) { // b > 0
    const std::int64_t q = a / b;
    return q - (a % b < 0 ? 1 : 0);
}

struct Candidate {
    double error;
    std::uint32_t pixel;
    std::uint32_t triangle;
    std::uint32_t version;
    bool operator<(const Candidate &other) const { // the largest error first; then the first pixel
        return error != other.error ? error < other.error : pixel > other.pixel;
    }
};

class Refiner {
  public:
    Refiner(std::span<const float> heights, std::uint32_t width, std::uint32_t height, double tolerance)
        : heights_(heights), width_(width), height_(height), tolerance_(tolerance),
          used_(heights.size(), false) {}

    Triangulation run() {
        const std::uint32_t a = add_vertex(0), b = add_vertex(width_ - 1);
        const std::uint32_t c = add_vertex(width_ * (height_ - 1)), d = add_vertex(width_ * height_ - 1);
        add_triangle(a, b, d);
        add_triangle(a, d, c);
        link(2, 3); // d -> a of the first, a -> d of the second
        touched_ = {0, 1};
        scan_touched();
        while (!queue_.empty()) {
            const Candidate next = queue_.top();
            queue_.pop();
            if (versions_[next.triangle] != next.version)
                continue;
            insert(next.triangle, next.pixel);
            scan_touched();
        }
        return {std::move(pixels_), std::move(corners_)};
    }

  private:
    std::span<const float> heights_;
    std::uint32_t width_, height_;
    double tolerance_;
    std::vector<bool> used_;              // pixels that are vertices
    std::vector<std::uint32_t> pixels_;   // per vertex
    std::vector<std::uint32_t> corners_;  // per half-edge: the vertex that it leaves
    std::vector<std::uint32_t> twins_;    // per half-edge: the one that runs back, or none
    std::vector<std::uint32_t> versions_; // per triangle: changes whenever it does
    std::vector<std::uint32_t> touched_;  // triangles to scan again
    std::vector<std::uint32_t> suspects_; // half-edges that may have to flip
    std::priority_queue<Candidate> queue_;

    static std::uint32_t next(std::uint32_t edge) { return edge % 3 == 2 ? edge - 2 : edge + 1; }
    static std::uint32_t previous(std::uint32_t edge) { return edge % 3 == 0 ? edge + 2 : edge - 1; }
    Point at(std::uint32_t vertex) const {
        return {static_cast<std::int64_t>(pixels_[vertex] % width_),
                static_cast<std::int64_t>(pixels_[vertex] / width_)};
    }

    std::uint32_t add_vertex(std::uint32_t pixel) {
        used_[pixel] = true;
        pixels_.push_back(pixel);
        return static_cast<std::uint32_t>(pixels_.size() - 1);
    }

    std::uint32_t add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        corners_.insert(corners_.end(), {a, b, c});
        twins_.insert(twins_.end(), {none, none, none});
        versions_.push_back(0);
        return static_cast<std::uint32_t>(versions_.size() - 1);
    }

    void set_triangle(std::uint32_t triangle, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        corners_[3 * triangle] = a;
        corners_[3 * triangle + 1] = b;
        corners_[3 * triangle + 2] = c;
    }

    void link(std::uint32_t edge, std::uint32_t twin) {
        twins_[edge] = twin;
        if (twin != none)
            twins_[twin] = edge;
    }

    void touch(std::uint32_t triangle) { touched_.push_back(triangle); }

    void insert(std::uint32_t triangle, std::uint32_t pixel) {
        const std::uint32_t p = add_vertex(pixel);
        const Point at_p = at(p);
        for (std::uint32_t edge = 3 * triangle; edge < 3 * triangle + 3; ++edge) {
            if (turn(at(corners_[edge]), at(corners_[next(edge)]), at_p) == 0) {
                split_edge(edge, p);
                settle(p);
                return;
            }
        }
        split_triangle(triangle, p);
        settle(p);
    }

    // a b c -> p between: (a b p) (b c p) (c a p)
    void split_triangle(std::uint32_t t0, std::uint32_t p) {
        const std::uint32_t e = 3 * t0;
        const std::uint32_t a = corners_[e], b = corners_[e + 1], c = corners_[e + 2];
        const std::uint32_t bc = twins_[e + 1], ca = twins_[e + 2];
        set_triangle(t0, a, b, p);
        const std::uint32_t t1 = add_triangle(b, c, p), t2 = add_triangle(c, a, p);
        link(3 * t1, bc);
        link(3 * t2, ca);
        link(e + 1, 3 * t1 + 2);
        link(3 * t1 + 1, 3 * t2 + 2);
        link(3 * t2 + 1, e + 2);
        touched_.insert(touched_.end(), {t0, t1, t2});
        suspects_ = {e, 3 * t1, 3 * t2};
    }

    // p on the edge a -> b of (a b c), and on b -> a of (b a d) where there is one
    void split_edge(std::uint32_t ab, std::uint32_t p) {
        const std::uint32_t t0 = ab / 3, bc = next(ab), ca = previous(ab), ba = twins_[ab];
        const std::uint32_t a = corners_[ab], b = corners_[bc], c = corners_[ca];
        const std::uint32_t outer_bc = twins_[bc], outer_ca = twins_[ca];
        set_triangle(t0, a, p, c);
        const std::uint32_t t1 = add_triangle(p, b, c);
        twins_[3 * t0] = none;
        link(3 * t0 + 1, 3 * t1 + 2);
        link(3 * t0 + 2, outer_ca);
        link(3 * t1 + 1, outer_bc);
        touched_.insert(touched_.end(), {t0, t1});
        suspects_ = {3 * t0 + 2, 3 * t1 + 1};
        if (ba == none)
            return;
        const std::uint32_t s0 = ba / 3, ad = next(ba), db = previous(ba);
        const std::uint32_t d = corners_[db], outer_ad = twins_[ad], outer_db = twins_[db];
        set_triangle(s0, b, p, d);
        const std::uint32_t s1 = add_triangle(p, a, d);
        twins_[3 * s0] = none;
        link(3 * s0 + 1, 3 * s1 + 2);
        link(3 * s0 + 2, outer_db);
        link(3 * s1 + 1, outer_ad);
        link(3 * t0, 3 * s1);
        link(3 * t1, 3 * s0);
        touched_.insert(touched_.end(), {s0, s1});
        suspects_.insert(suspects_.end(), {3 * s0 + 2, 3 * s1 + 1});
    }

    // Lawson's flips: each suspect edge lies opposite to p in its triangle.
    void settle(std::uint32_t p) {
        while (!suspects_.empty()) {
            const std::uint32_t ab = suspects_.back();
            suspects_.pop_back();
            const std::uint32_t ba = twins_[ab];
            if (ba == none)
                continue;
            const std::uint32_t bp = next(ab), pa = previous(ab), ad = next(ba), db = previous(ba);
            const std::uint32_t a = corners_[ab], b = corners_[bp], d = corners_[db];
            if (!in_circle(at(a), at(b), at(p), at(d)))
                continue;
            const std::uint32_t t = ab / 3, s = ba / 3;
            const std::uint32_t outer_bp = twins_[bp], outer_pa = twins_[pa];
            const std::uint32_t outer_ad = twins_[ad], outer_db = twins_[db];
            set_triangle(t, a, d, p);
            set_triangle(s, d, b, p);
            link(3 * t, outer_ad);
            link(3 * t + 2, outer_pa);
            link(3 * s, outer_db);
            link(3 * s + 1, outer_bp);
            link(3 * t + 1, 3 * s + 2);
            touch(t);
            touch(s);
            suspects_.push_back(3 * t);
            suspects_.push_back(3 * s);
        }
    }

    void scan_touched() {
        std::sort(touched_.begin(), touched_.end());
        touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
        for (const std::uint32_t triangle : touched_) {
            ++versions_[triangle];
            scan(triangle);
        }
        touched_.clear();
    }

    // Queues the worst pixel of a triangle, its border included, when it is off by more than the tolerance.
    void scan(std::uint32_t triangle) {
        Point p[3];
        double z[3];
        for (int k = 0; k < 3; ++k) {
            p[k] = at(corners_[3 * triangle + static_cast<std::uint32_t>(k)]);
            z[k] = heights_[pixels_[corners_[3 * triangle + static_cast<std::uint32_t>(k)]]];
        }
        const double area = static_cast<double>(turn(p[0], p[1], p[2]));
        const double x1 = static_cast<double>(p[1].x - p[0].x), y1 = static_cast<double>(p[1].y - p[0].y);
        const double x2 = static_cast<double>(p[2].x - p[0].x), y2 = static_cast<double>(p[2].y - p[0].y);
        const double per_x = ((z[1] - z[0]) * y2 - (z[2] - z[0]) * y1) / area;
        const double per_y = ((z[2] - z[0]) * x1 - (z[1] - z[0]) * x2) / area;
        const std::int64_t top = std::min({p[0].y, p[1].y, p[2].y}),
                           bottom = std::max({p[0].y, p[1].y, p[2].y});
        double worst = tolerance_;
        std::uint32_t worst_pixel = none;
        for (std::int64_t y = top; y <= bottom; ++y) {
            std::int64_t from = std::min({p[0].x, p[1].x, p[2].x}), to = std::max({p[0].x, p[1].x, p[2].x});
            for (int k = 0; k < 3; ++k) { // inside: turn(a, b, (x, y)) >= 0
                const Point a = p[k], b = p[(k + 1) % 3];
                const std::int64_t dx = b.x - a.x, dy = b.y - a.y;
                if (dy > 0)
                    to = std::min(to, a.x + floor_div(dx * (y - a.y), dy));
                else if (dy < 0)
                    from = std::max(from, a.x - floor_div(dx * (y - a.y), -dy));
            }
            const double at_row = z[0] + per_y * static_cast<double>(y - p[0].y);
            const std::size_t row = static_cast<std::size_t>(y) * width_;
            for (std::int64_t x = from; x <= to; ++x) {
                const double plane = at_row + per_x * static_cast<double>(x - p[0].x);
                const double error = std::fabs(heights_[row + static_cast<std::size_t>(x)] - plane);
                if (error > worst && !used_[row + static_cast<std::size_t>(x)]) {
                    worst = error;
                    worst_pixel = static_cast<std::uint32_t>(row + static_cast<std::size_t>(x));
                }
            }
        }
        if (worst_pixel != none)
            queue_.push({worst, worst_pixel, triangle, versions_[triangle]});
    }
};

} // namespace

Triangulation refine(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance) {
    return Refiner(heights, width, height, tolerance).run();
}

} // namespace paradize::terrain
