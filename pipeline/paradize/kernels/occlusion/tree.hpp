// The triangles of a mesh in a tree of boxes, for rays that ask whether anything is in their way.
// Source: I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007 (the binned build).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::occlusion {

// A box. Of an inner node the left child follows it, and the right one is at `right`; a leaf has right == 0
// and holds the triangles [first, first + count) of Tree::corners.
struct Node {
    std::array<float, 3> low, high;
    std::uint32_t right, first, count;
    std::uint32_t axis; // along which the children lie
};

struct Tree {
    std::vector<Node> nodes;                   // empty: no triangles
    std::vector<std::array<float, 9>> corners; // in the order of the leaves
};

// So many nodes at most lie between the root and a leaf.
constexpr std::size_t deepest = 96;

// positions: (n, 3), finite. triangles: (m, 3); those without an area hold nothing back and are left out.
Tree build_tree(std::span<const float> positions, std::span<const std::uint32_t> triangles);

} // namespace paradize::occlusion
