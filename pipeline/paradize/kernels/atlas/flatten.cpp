#include "atlas/flatten.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "atlas/border.hpp"

namespace paradize::atlas {

namespace {

constexpr int rounds = 8;
constexpr int steps = 60;
constexpr double enough = 1e-4; // of the first residual, when a solve ends
// A chart is not rigid enough where its mean stretch is more than this; one this many times as far after two
// rounds is given up, as six more hardly halve it.
constexpr double most_stretch = 0.02;
constexpr double hopeless = 3;
// Slivers thinner than this share of their longest side's square are as stiff as one of this.
constexpr double thinnest = 1e-4;
// A triangle is turned over where its image has less than this share of its area.
constexpr double least_area = 1e-3;
// The Laplacian of the chart's edges by rows.
struct Matrix {
    std::vector<std::uint32_t> first, column;
    std::vector<double> value, diagonal;

    void multiply(const std::vector<Vec> &v, std::vector<Vec> &out) const {
        for (std::size_t i = 0; i < diagonal.size(); ++i) {
            Vec sum{diagonal[i] * v[i].x, diagonal[i] * v[i].y};
            for (std::uint32_t e = first[i]; e < first[i + 1]; ++e) {
                sum.x += value[e] * v[column[e]].x;
                sum.y += value[e] * v[column[e]].y;
            }
            out[i] = sum;
        }
    }
};

class Chart {
  public:
    Chart(const Surface &surface, std::span<const std::uint32_t> own) {
        std::vector<std::uint32_t> used;
        for (const std::uint32_t t : own) {
            used.insert(used.end(), surface.triangles.begin() + 3 * std::ptrdiff_t{t},
                        surface.triangles.begin() + 3 * std::ptrdiff_t{t} + 3);
        }
        std::ranges::sort(used);
        used.erase(std::unique(used.begin(), used.end()), used.end());
        places_.resize(used.size());
        for (const std::uint32_t t : own) {
            Triangle triangle;
            std::array<const double *, 3> p{};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t vertex = surface.triangles[3 * std::size_t{t} + k];
                triangle.corner[k] =
                    static_cast<std::uint32_t>(std::ranges::lower_bound(used, vertex) - used.begin());
                p[k] = surface.positions.data() + 3 * std::size_t{vertex};
            }
            shape(triangle, p);
            area2_ += triangle.area2;
            triangles_.push_back(triangle);
        }
        project(surface, used);
        build();
    }

    std::vector<double> run() {
        if (std::ranges::any_of(triangles_, [](const Triangle &t) { return t.area2 > 0; })) {
            for (int round = 0; round < rounds; ++round) {
                relax();
                if (round == 1 && stretch_of(triangles_, area2_, places_).mean > hopeless * most_stretch) {
                    return {};
                }
            }
        }
        for (const Vec &place : places_) {
            if (!std::isfinite(place.x) || !std::isfinite(place.y)) {
                return {};
            }
        }
        for (const Triangle &t : triangles_) {
            const double image = cross(at(t, 1) - at(t, 0), at(t, 2) - at(t, 0));
            if (!(image > (t.area2 > 0 ? least_area * t.area2 : -least_area * t.stiff))) {
                return {};
            }
        }
        const Stretch stretch = stretch_of(triangles_, area2_, places_);
        if (stretch.torn || stretch.mean > most_stretch || overlaps_itself(triangles_, places_)) {
            return {};
        }
        turn_upright(places_);
        std::vector<double> out;
        out.reserve(triangles_.size() * 6);
        for (const Triangle &t : triangles_) {
            for (std::size_t k = 0; k < 3; ++k) {
                out.push_back(at(t, k).x);
                out.push_back(at(t, k).y);
            }
        }
        return out;
    }

  private:
    const Vec &at(const Triangle &t, std::size_t k) const { return places_[t.corner[k]]; }

  public:
    // Fills in all but the corners' numbers.
    static void shape(Triangle &t, const std::array<const double *, 3> &p) {
        double a[3], b[3], n[3];
        double aa = 0, bb = 0, ab = 0;
        for (int k = 0; k < 3; ++k) {
            a[k] = p[1][k] - p[0][k];
            b[k] = p[2][k] - p[0][k];
            aa += a[k] * a[k];
            bb += b[k] * b[k];
            ab += a[k] * b[k];
        }
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            n[k] = a[i] * b[j] - a[j] * b[i];
        }
        t.area2 = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        const double side = std::sqrt(aa);
        if (!(side > 0)) {
            t.area2 = 0;
        } else {
            t.rest = {Vec{}, Vec{side, 0}, Vec{ab / side, t.area2 / side}};
        }
        const double cc = aa + bb - 2 * ab;
        t.stiff = std::max(t.area2, thinnest * std::max({aa, bb, cc}));
        if (t.stiff > 0) { // all three divided by one number: the sum of squares stays one
            t.weight = {(bb - ab) / t.stiff / 2, ab / t.stiff / 2, (aa - ab) / t.stiff / 2};
        }
    }

  private:
    // Starts with the view along the mean normal.
    void project(const Surface &surface, const std::vector<std::uint32_t> &used) {
        std::array<double, 3> n{};
        for (const Triangle &t : triangles_) {
            const double *p[3];
            for (std::size_t k = 0; k < 3; ++k) {
                p[k] = surface.positions.data() + 3 * std::size_t{used[t.corner[k]]};
            }
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
                n[k] += (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
            }
        }
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (!(length > 0)) {
            n = {0, 0, 1};
        } else {
            for (double &value : n) {
                value /= length;
            }
        }
        const std::size_t least = std::abs(n[0]) <= std::abs(n[1]) && std::abs(n[0]) <= std::abs(n[2]) ? 0
                                  : std::abs(n[1]) <= std::abs(n[2])                                   ? 1
                                                                                                       : 2;
        std::array<double, 3> u{}, v{};
        u[least] = 1;
        for (std::size_t k = 0; k < 3; ++k) {
            u[k] -= n[least] * n[k];
        }
        const double size = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        for (double &value : u) {
            value /= size;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            v[k] = n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3];
        }
        for (std::size_t i = 0; i < used.size(); ++i) {
            const double *p = surface.positions.data() + 3 * std::size_t{used[i]};
            places_[i] = {p[0] * u[0] + p[1] * u[1] + p[2] * u[2], p[0] * v[0] + p[1] * v[1] + p[2] * v[2]};
        }
    }

    void build() {
        struct Entry {
            std::uint32_t row, column;
            double value;
        };
        std::vector<Entry> entries;
        matrix_.diagonal.assign(places_.size(), 0);
        for (const Triangle &t : triangles_) {
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t i = t.corner[k], j = t.corner[(k + 1) % 3];
                entries.push_back({i, j, -t.weight[k]});
                entries.push_back({j, i, -t.weight[k]});
                matrix_.diagonal[i] += t.weight[k];
                matrix_.diagonal[j] += t.weight[k];
            }
        }
        std::ranges::stable_sort(entries, [](const Entry &a, const Entry &b) {
            return a.row != b.row ? a.row < b.row : a.column < b.column;
        });
        matrix_.first.assign(places_.size() + 1, 0);
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (i > 0 && entries[i].row == entries[i - 1].row && entries[i].column == entries[i - 1].column) {
                matrix_.value.back() += entries[i].value;
                continue;
            }
            matrix_.column.push_back(entries[i].column);
            matrix_.value.push_back(entries[i].value);
            ++matrix_.first[entries[i].row + 1];
        }
        for (std::size_t i = 0; i < places_.size(); ++i) {
            matrix_.first[i + 1] += matrix_.first[i];
        }
    }

    // Each triangle's best turn, then the places that agree best with all of them (conjugate gradients from
    // where they are).
    void relax() {
        const std::size_t count = places_.size();
        std::vector<Vec> wanted(count), residual(count), image(count), step(count), scaled(count);
        for (const Triangle &t : triangles_) {
            double c = 0, s = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t l = (k + 1) % 3;
                const Vec now = at(t, k) - at(t, l), rest = t.rest[k] - t.rest[l];
                c += t.weight[k] * (now.x * rest.x + now.y * rest.y);
                s += t.weight[k] * (now.y * rest.x - now.x * rest.y);
            }
            const double size = std::sqrt(c * c + s * s);
            c = size > 0 ? c / size : 1;
            s = size > 0 ? s / size : 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t l = (k + 1) % 3;
                const Vec rest = t.rest[k] - t.rest[l];
                const Vec turned{t.weight[k] * (c * rest.x - s * rest.y),
                                 t.weight[k] * (s * rest.x + c * rest.y)};
                wanted[t.corner[k]].x += turned.x;
                wanted[t.corner[k]].y += turned.y;
                wanted[t.corner[l]].x -= turned.x;
                wanted[t.corner[l]].y -= turned.y;
            }
        }
        matrix_.multiply(places_, image);
        Vec before{}, start{};
        const auto precondition = [&] {
            Vec dot{};
            for (std::size_t i = 0; i < count; ++i) {
                const double d = matrix_.diagonal[i] > 0 ? 1 / matrix_.diagonal[i] : 0;
                scaled[i] = {residual[i].x * d, residual[i].y * d};
                dot.x += residual[i].x * scaled[i].x;
                dot.y += residual[i].y * scaled[i].y;
            }
            return dot;
        };
        // Less than this is rounding, which would push the whole chart about without end.
        double noise = 0;
        for (std::size_t i = 0; i < count; ++i) {
            residual[i] = wanted[i] - image[i];
            const double d = matrix_.diagonal[i] > 0 ? 1 / matrix_.diagonal[i] : 0;
            noise += 1e-24 * d * (wanted[i].x * wanted[i].x + wanted[i].y * wanted[i].y);
        }
        before = start = precondition();
        step = scaled;
        for (int n = 0;
             n < steps && before.x + before.y > std::max(noise, enough * enough * (start.x + start.y)); ++n) {
            matrix_.multiply(step, image);
            Vec along{};
            for (std::size_t i = 0; i < count; ++i) {
                along.x += step[i].x * image[i].x;
                along.y += step[i].y * image[i].y;
            }
            const Vec by{before.x > noise && along.x > 0 ? before.x / along.x : 0,
                         before.y > noise && along.y > 0 ? before.y / along.y : 0};
            for (std::size_t i = 0; i < count; ++i) {
                places_[i].x += by.x * step[i].x;
                places_[i].y += by.y * step[i].y;
                residual[i].x -= by.x * image[i].x;
                residual[i].y -= by.y * image[i].y;
            }
            const Vec after = precondition();
            const Vec turn{before.x > 0 ? after.x / before.x : 0, before.y > 0 ? after.y / before.y : 0};
            for (std::size_t i = 0; i < count; ++i) {
                step[i] = {scaled[i].x + turn.x * step[i].x, scaled[i].y + turn.y * step[i].y};
            }
            before = after;
        }
    }

    std::vector<Triangle> triangles_;
    std::vector<Vec> places_;
    double area2_ = 0;
    Matrix matrix_;
};

} // namespace

std::vector<double> flatten(const Surface &surface, std::span<const std::uint32_t> own) {
    return Chart(surface, own).run();
}

std::vector<double> own_shape(const Surface &surface, std::uint32_t triangle) {
    Triangle t;
    std::array<const double *, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
        p[k] = surface.positions.data() + 3 * std::size_t{surface.triangles[3 * std::size_t{triangle} + k]};
    }
    Chart::shape(t, p);
    return {t.rest[0].x, t.rest[0].y, t.rest[1].x, t.rest[1].y, t.rest[2].x, t.rest[2].y};
}

} // namespace paradize::atlas
