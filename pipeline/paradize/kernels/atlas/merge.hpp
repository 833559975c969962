// Triangles joined pair by pair into charts, with the tree of the joins.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "atlas/charts.hpp"

namespace paradize::atlas {

struct Tree {
    // Nodes 0 to m - 1 are the triangles; a node beyond holds its two parts.
    std::vector<std::array<std::uint32_t, 2>> parts; // of node m + k
    std::vector<std::uint32_t> roots;                // nodes that are in no other, in rising order
    std::size_t triangles = 0;

    // The triangles of a node, in the tree's order.
    std::vector<std::uint32_t> leaves(std::uint32_t node) const;
};

// Joins the two neighbours whose union is the flattest and roundest, as long as there are two whose union is
// no farther from flat than `deviation`.
Tree merge_triangles(const Surface &surface, double deviation);

} // namespace paradize::atlas
