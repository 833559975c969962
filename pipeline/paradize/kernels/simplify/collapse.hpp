// Simplification of a triangle mesh by collapsing edges.
//
// Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997 (quadrics,
// optimal placement, planes that hold borders); H. Hoppe, "New quadric metric for simplifying meshes with
// appearance attributes", 1999 (wedges, attributes as linear functions); T. Dey, H. Edelsbrunner, S. Guha and
// D. Nekhayev, "Topology preserving edge contraction", 1998 (link condition).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::simplify {

// positions: (n, 3) centred, of a diagonal near 1. triangles: (m, 3). attributes: (n, a), in any units;
// weights: (a), what a difference of 1 weighs beside a distance of 1. unit: first of three columns that hold
// unit vectors, or -1. place: (n) number of each vertex's place, below n; the same for vertices of one
// position. group: (m).
struct Input {
    std::span<const double> positions;
    std::span<const std::uint32_t> triangles;
    std::span<const float> attributes;
    std::span<const float> weights;
    std::ptrdiff_t unit = -1;
    std::span<const std::uint32_t> place;
    std::span<const std::uint32_t> group;
};

// target: stops at so many triangles or fewer. kept_area: the share of its area that every component keeps, 0
// to 1.
struct Limits {
    std::size_t target = 0;
    double kept_area = 0.0;
};

enum class Stop : std::uint8_t { target, nothing };

// Vertices in order of first use; triangles in their source's order.
struct Result {
    std::vector<double> positions;        // (k, 3)
    std::vector<std::uint32_t> triangles; // (j, 3)
    std::vector<float> attributes;        // (k, a)
    std::vector<std::uint32_t> vertex;    // (k) a source vertex that became part of it
    std::vector<std::uint32_t> place;     // (k) equal for vertices of one place, in order of first use
    std::vector<std::uint32_t> triangle;  // (j) source triangle
    Stop stop = Stop::target;
};

Result simplify(const Input &input, const Limits &limits);

} // namespace paradize::simplify
