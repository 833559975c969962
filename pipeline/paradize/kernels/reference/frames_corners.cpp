#include "reference/frames.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <vector>

#include "math/functions.hpp"
#include "math/vec.hpp"
#include "unify.hpp"

namespace paradize::reference {
namespace {

using mesh::any_perpendicular;
using mesh::at3;
using mesh::Vec;

constexpr std::uint32_t none = 0xffffffffu;
// Groups larger than this are averaged whole: comparing all pairs of their faces would be quadratic.
constexpr std::size_t largest_compared_group = 256;

struct Triangle {
    std::array<std::uint32_t, 3> vertex;                      // welded
    std::array<std::uint32_t, 3> neighbour{none, none, none}; // across the edge from corner k to k + 1
    std::array<std::uint32_t, 3> group{none, none, none};
    Vec s;                       // unit direction of growing u
    Vec t;                       // unit direction of growing v
    bool preserves = false;      // the image is not mirrored on it
    bool takes_any_group = true; // without area in the image: it follows its neighbours
    bool flat = false;           // two corners at one position
};

struct Group {
    std::uint32_t vertex;
    bool preserves;
    std::vector<std::uint32_t> triangles;
};

bool not_zero(double x) {
    return std::fabs(x) > static_cast<double>(std::numeric_limits<float>::min());
}

Vec on_plane(Vec v, Vec normal) {
    return unit(v - dot(normal, v) * normal);
}

class Frames {
  public:
    Frames(std::span<const float> positions, std::span<const float> normals, std::span<const float> uvs,
           std::span<const std::uint32_t> triangles, std::span<float> out)
        : positions_(positions), normals_(normals), uvs_(uvs), out_(out) {
        weld(triangles);
        for (Triangle &triangle : triangles_)
            measure(triangle);
        pair_edges();
        build_groups();
    }

    void write() {
        tangent_.assign(triangles_.size() * 3, Vec{});
        sign_.assign(triangles_.size() * 3, 1.0f);
        for (std::uint32_t g = 0; g < groups_.size(); ++g)
            evaluate(g);
        follow_vertices();
        for (std::size_t c = 0; c < tangent_.size(); ++c) {
            const Vec n = normal_of(triangles_[c / 3].vertex[c % 3]);
            Vec t = on_plane(on_plane(tangent_[c], n), n);
            if (t == Vec{})
                t = any_perpendicular(n);
            out_[c * 4] = static_cast<float>(t.x);
            out_[c * 4 + 1] = static_cast<float>(t.y);
            out_[c * 4 + 2] = static_cast<float>(t.z);
            out_[c * 4 + 3] = sign_[c];
        }
    }

  private:
    Vec position_of(std::uint32_t vertex) const { return at3(positions_, first_[vertex]); }
    Vec normal_of(std::uint32_t vertex) const { return unit(at3(normals_, first_[vertex])); }

    // Vertices that agree in position, normal and uv are one.
    void weld(std::span<const std::uint32_t> triangles) {
        const auto key = [&](std::size_t i, std::size_t k) {
            return k < 3 ? positions_[i * 3 + k] : k < 6 ? normals_[i * 3 + k - 3] : uvs_[i * 2 + k - 6];
        };
        Numbered numbered = number_equal(
            positions_.size() / 3,
            [&](std::size_t i) {
                std::uint64_t h = hash_seed;
                for (std::size_t k = 0; k < 8; ++k)
                    h = mix(h, float_key(key(i, k)));
                return h;
            },
            [&](std::size_t a, std::size_t b) {
                for (std::size_t k = 0; k < 8; ++k)
                    if (key(a, k) != key(b, k))
                        return false;
                return true;
            });
        first_ = std::move(numbered.first);
        triangles_.resize(triangles.size() / 3);
        for (std::size_t c = 0; c < triangles.size(); ++c)
            triangles_[c / 3].vertex[c % 3] = numbered.index[triangles[c]];
    }

    void measure(Triangle &triangle) const {
        const auto &v = triangle.vertex;
        const Vec p0 = position_of(v[0]), p1 = position_of(v[1]), p2 = position_of(v[2]);
        triangle.flat = p0 == p1 || p1 == p2 || p0 == p2;
        const float *const a = &uvs_[first_[v[0]] * std::size_t{2}];
        const float *const b = &uvs_[first_[v[1]] * std::size_t{2}];
        const float *const c = &uvs_[first_[v[2]] * std::size_t{2}];
        // In float32 as the reference does: on slivers the sign of this area decides the split.
        const float t21x = b[0] - a[0], t21y = b[1] - a[1], t31x = c[0] - a[0], t31y = c[1] - a[1];
        const float area = t21x * t31y - t21y * t31x;
        triangle.preserves = area > 0;
        if (!not_zero(area) || !std::isfinite(area))
            return;
        const Vec d1 = p1 - p0, d2 = p2 - p0;
        const double sign = triangle.preserves ? 1 : -1;
        const Vec s = static_cast<double>(t31y) * d1 - static_cast<double>(t21y) * d2;
        const Vec t = static_cast<double>(t21x) * d2 - static_cast<double>(t31x) * d1;
        triangle.s = sign * unit(s);
        triangle.t = sign * unit(t);
        const double size = std::fabs(static_cast<double>(area));
        triangle.takes_any_group = !not_zero(length(s) / size) || !not_zero(length(t) / size);
    }

    struct Edge {
        std::uint32_t low, high, triangle, side;
        bool forward; // runs from low to high in its triangle
    };

    // Triangles across an edge: the first that runs along it with the first that runs against it, and so on.
    void pair_edges() {
        std::vector<Edge> edges;
        edges.reserve(triangles_.size() * 3);
        for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
            if (triangles_[f].flat)
                continue;
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t a = triangles_[f].vertex[k], b = triangles_[f].vertex[(k + 1) % 3];
                edges.push_back({std::min(a, b), std::max(a, b), f, k, a < b});
            }
        }
        std::ranges::sort(edges, [](const Edge &a, const Edge &b) {
            return std::tie(a.low, a.high, a.triangle, a.side) < std::tie(b.low, b.high, b.triangle, b.side);
        });
        for (std::size_t i = 0; i < edges.size();) {
            std::size_t stop = i;
            while (stop < edges.size() && edges[stop].low == edges[i].low &&
                   edges[stop].high == edges[i].high)
                ++stop;
            std::size_t along = i, against = i;
            while (true) {
                while (along < stop && !edges[along].forward)
                    ++along;
                while (against < stop && edges[against].forward)
                    ++against;
                if (along >= stop || against >= stop)
                    break;
                const Edge &a = edges[along++], &b = edges[against++];
                triangles_[a.triangle].neighbour[a.side] = b.triangle;
                triangles_[b.triangle].neighbour[b.side] = a.triangle;
            }
            i = stop;
        }
    }

    // Corners that share a vertex, are joined by edges and have the same handedness share a frame.
    void build_groups() {
        std::vector<std::uint32_t> open;
        for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
            for (std::uint32_t k = 0; k < 3; ++k) {
                Triangle &triangle = triangles_[f];
                if (triangle.flat || triangle.takes_any_group || triangle.group[k] != none)
                    continue;
                const auto number = static_cast<std::uint32_t>(groups_.size());
                groups_.push_back({triangle.vertex[k], triangle.preserves, {f}});
                triangle.group[k] = number;
                open = {triangle.neighbour[k], triangle.neighbour[(k + 2) % 3]};
                while (!open.empty()) {
                    const std::uint32_t next = open.back();
                    open.pop_back();
                    if (next != none)
                        join(next, number, open);
                }
            }
        }
    }

    void join(std::uint32_t f, std::uint32_t number, std::vector<std::uint32_t> &open) {
        Triangle &triangle = triangles_[f];
        Group &group = groups_[number];
        std::uint32_t k = 0;
        while (k < 3 && triangle.vertex[k] != group.vertex)
            ++k;
        if (k == 3 || triangle.group[k] != none)
            return;
        const bool untouched = triangle.group == std::array<std::uint32_t, 3>{none, none, none};
        if (triangle.takes_any_group && untouched)
            triangle.preserves = group.preserves;
        if (triangle.preserves != group.preserves)
            return;
        triangle.group[k] = number;
        group.triangles.push_back(f);
        open.push_back(triangle.neighbour[k]);
        open.push_back(triangle.neighbour[(k + 2) % 3]);
    }

    std::uint32_t corner_in(std::uint32_t f, std::uint32_t vertex) const {
        const auto &v = triangles_[f].vertex;
        return v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
    }

    // The angle-weighted mean of the u directions of `members` at a vertex, in the plane of its normal.
    Vec mean(std::span<const std::uint32_t> members, std::uint32_t vertex, Vec n) const {
        Vec sum;
        for (const std::uint32_t f : members) {
            const Triangle &triangle = triangles_[f];
            if (triangle.takes_any_group)
                continue;
            const std::uint32_t k = corner_in(f, vertex);
            const Vec p = position_of(vertex);
            const Vec a = on_plane(position_of(triangle.vertex[(k + 2) % 3]) - p, n);
            const Vec b = on_plane(position_of(triangle.vertex[(k + 1) % 3]) - p, n);
            sum = sum + mathx::acos(std::clamp(dot(a, b), -1.0, 1.0)) * on_plane(triangle.s, n);
        }
        return unit(sum);
    }

    void evaluate(std::uint32_t number) {
        Group &group = groups_[number];
        std::ranges::sort(group.triangles);
        const Vec n = normal_of(group.vertex);
        const std::size_t size = group.triangles.size();
        std::vector<Vec> s(size), t(size);
        bool together = true;
        for (std::size_t i = 0; i < size; ++i) {
            s[i] = on_plane(triangles_[group.triangles[i]].s, n);
            t[i] = on_plane(triangles_[group.triangles[i]].t, n);
        }
        // Faces whose directions are opposite do not share a frame. All others do.
        const auto opposite = [&](std::size_t i, std::size_t j) {
            return !triangles_[group.triangles[i]].takes_any_group &&
                   !triangles_[group.triangles[j]].takes_any_group &&
                   (static_cast<float>(dot(s[i], s[j])) <= -1.0f ||
                    static_cast<float>(dot(t[i], t[j])) <= -1.0f);
        };
        if (size <= largest_compared_group)
            for (std::size_t i = 0; i < size && together; ++i)
                for (std::size_t j = i + 1; j < size && together; ++j)
                    together = !opposite(i, j);
        Vec shared = together ? mean(group.triangles, group.vertex, n) : Vec{};
        std::vector<std::uint32_t> members;
        for (std::size_t i = 0; i < size; ++i) {
            if (!together) {
                members.clear();
                for (std::size_t j = 0; j < size; ++j)
                    if (i == j || !opposite(i, j))
                        members.push_back(group.triangles[j]);
                shared = mean(members, group.vertex, n);
            }
            const std::uint32_t f = group.triangles[i];
            const std::size_t c = f * std::size_t{3} + corner_in(f, group.vertex);
            tangent_[c] = shared;
            sign_[c] = group.preserves ? -1.0f : 1.0f; // v grows down the image, B points up
        }
    }

    // Corners of triangles without area in space take the frame of another corner of the same vertex.
    void follow_vertices() {
        std::vector<std::uint32_t> donor(first_.size(), none);
        for (std::uint32_t c = 0; c < tangent_.size(); ++c) {
            std::uint32_t &known = donor[triangles_[c / 3].vertex[c % 3]];
            if (known == none && triangles_[c / 3].group[c % 3] != none)
                known = c;
        }
        for (std::uint32_t c = 0; c < tangent_.size(); ++c) {
            const std::uint32_t from = donor[triangles_[c / 3].vertex[c % 3]];
            if (triangles_[c / 3].group[c % 3] == none && from != none) {
                tangent_[c] = tangent_[from];
                sign_[c] = sign_[from];
            }
        }
    }

    std::span<const float> positions_, normals_, uvs_;
    std::span<float> out_;
    std::vector<std::uint32_t> first_; // a vertex with the values of each welded vertex
    std::vector<Triangle> triangles_;
    std::vector<Group> groups_;
    std::vector<Vec> tangent_;
    std::vector<float> sign_;
};

} // namespace

void corner_tangents(std::span<const float> positions, std::span<const float> normals,
                     std::span<const float> uvs, std::span<const std::uint32_t> triangles,
                     std::span<float> out) {
    Frames(positions, normals, uvs, triangles, out).write();
}

} // namespace paradize::reference
