// The triangles of a surface in a tree of boxes, four to a node, to find the nearest place to many points
// that lie close together. For metrics only: stages have a tree of their own (mesh/triangle_tree.hpp), so
// that neither hides the other's faults. Sources: I. Wald, "On fast construction of SAH-based bounding volume
// hierarchies", 2007; H. Dammertz, J. Hanika and A. Keller, "Shallow bounding volume hierarchies for fast
// SIMD ray tracing of incoherent rays", 2008.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace paradize::reference {

using Point = std::array<double, 3>;
using Corners = std::array<Point, 3>;

struct Surface {
    std::span<const float> positions;         // (n, 3), any unit, finite
    std::span<const std::uint32_t> triangles; // (m, 3), m > 0
};

inline Corners corners_of(const Surface &surface, std::size_t triangle) {
    Corners out;
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            out[k][axis] = surface.positions[surface.triangles[triangle * 3 + k] * std::size_t{3} + axis];
    return out;
}
inline Point minus(const Point &a, const Point &b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point along(const Point &a, double s, const Point &d) {
    return {a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]};
}
inline double dot(const Point &a, const Point &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point &a, const Point &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Points that are looked up together.
struct Packet {
    static constexpr std::size_t size = 16;
    static constexpr std::uint32_t none = 0xffffffffu;
    alignas(64) std::array<double, size> x, y, z;
    alignas(64) std::array<double, size> best; // squared distance; on entry the most that counts
    alignas(
        64) std::array<double, size> slot; // place in the tree of the nearest triangle; < 0: none was found
};

class Tree {
  public:
    struct Entry {
        double distance;
        std::uint64_t child;
    };
    // A child is a node's number, or with leaf_bit eight times its first slot plus how many it holds.
    static constexpr std::uint64_t leaf_bit = std::uint64_t{1} << 63, empty = ~std::uint64_t{0};
    static constexpr std::size_t leaf_size = 4;
    static constexpr std::size_t most_open = 256; // three for each level but the last, of at most 40 and 32
    struct Node {
        double low[3][4], high[3][4];
        std::uint64_t child[4];
    };

    explicit Tree(const Surface &surface);

    const Surface &surface() const { return surface_; }
    // Triangles in an order in which neighbours lie near each other.
    std::span<const std::uint32_t> order() const { return order_; }
    std::uint32_t triangle(double slot) const { return order_[static_cast<std::size_t>(slot)]; }
    std::span<const Node> nodes() const { return nodes_; } // the root first, children behind their parents

    // Lowers `best` and sets `slot` of every point to those of the nearest triangle; `hint` (a slot) is tried
    // first. With `facing` (any length; null: none) only triangles whose normal has a positive product with
    // it count. Returns how many triangles were tested: nearly all where they lie along one another.
    std::size_t nearest(Packet &packet, double hint, const Point *facing) const;

    // The corners of the triangle in a slot: of neighbours they lie side by side.
    Corners corners(std::size_t slot) const {
        const std::array<float, 9> &c = corners_[slot];
        return {Point{c[0], c[1], c[2]}, Point{c[3], c[4], c[5]}, Point{c[6], c[7], c[8]}};
    }

  private:
    struct Range {
        std::size_t first, stop;
    };
    struct Box;
    std::uint64_t build(Range range, unsigned depth);
    std::size_t split(Range range, unsigned depth);
    Box box_of(Range range) const;

    Surface surface_;
    std::vector<std::uint32_t> order_;
    std::vector<std::array<float, 3>> middles_; // by triangle, while building
    std::vector<std::array<float, 9>> corners_; // by slot
    std::vector<Node> nodes_;
};

} // namespace paradize::reference
