// The quadrics of the surface that every vertex and wedge stands for.
#pragma once

#include <cstddef>
#include <vector>

#include "simplify/collapse.hpp"
#include "simplify/mesh.hpp"
#include "simplify/quadric.hpp"

namespace paradize::simplify {

// A vertex: squared distances to the planes of its triangles, weighted by area, with those of the planes that
// hold its borders and seams, and what the attributes of each of its wedges already differ from their mean.
// Two cache lines.
struct alignas(64) VertexQuadric {
    Quadric all;
    Vec at;
};

// Four floats that are computed with at once.
using Float4 = float __attribute__((vector_size(16)));

// A wedge is `stride` Float4: its area and whether it moved, then for each attribute the mean, by area, of
// the linear functions that its triangles extend the attribute to: gradient, and value at the vertex.
inline constexpr float at_source = 1.0F; // attributes as they were
inline constexpr float moved_on = 2.0F;

struct Quadrics {
    Array<VertexQuadric> vertices; // (vertices)
    Array<Float4> wedges;          // (wedges, stride)
    std::vector<float> squares;    // (a) weights squared
    std::size_t width = 0;         // a
    std::size_t stride = 1;        // a + 1
    bool weighed = false;          // whether any attribute weighs something

    Float4 *wedge(std::uint32_t w) { return wedges.data() + w * stride; }
    const Float4 *wedge(std::uint32_t w) const { return wedges.data() + w * stride; }
};

Quadrics initial_quadrics(const Input &input, const Surface &surface);

} // namespace paradize::simplify
