// Where an edge's ends would become one vertex, and what that costs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "simplify/cost.hpp"
#include "simplify/mesh.hpp"

namespace paradize::simplify {

// Wedges of an edge's ends that become one; none where there are fewer than three.
struct WedgeSet {
    std::array<std::uint32_t, 3> wedge; // the first is p's
    bool third_is_p;                    // whose the third is; the second is q's
};

// The sets that an edge's triangles pair up: two where its ends are both on the seam, else one.
struct WedgeSets {
    std::array<WedgeSet, 2> set;
    std::uint32_t count;

    const WedgeSet *begin() const { return set.data(); }
    const WedgeSet *end() const { return set.data() + count; }
};

WedgeSets match_wedges(const Surface &surface, std::uint32_t h);

struct Placement {
    double cost;
    Vec at;
};

// exact: with what the wedges' attributes come to differ from each other; without, a bound from below.
Placement optimal_placement(const Surface &surface, const Quadrics &quadrics, std::uint32_t h, bool exact);

// Adds to `all`, about the origin `at`, what attributes differ when `other` becomes one with `into`, squared
// and weighed; `into` becomes the mean of both, its values at `at`. Origins: at_into, at_other.
void merge_attributes(const Quadrics &quadrics, Float4 *into, Vec at_into, const Float4 *other, Vec at_other,
                      Vec at, Quadric &all);

} // namespace paradize::simplify
