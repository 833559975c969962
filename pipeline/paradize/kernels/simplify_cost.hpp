// What every vertex and wedge remembers of the surface that it stands for.
#pragma once

#include <vector>

#include "simplify_collapse.hpp"
#include "simplify_mesh.hpp"
#include "simplify_quadric.hpp"

namespace paradize::simplify {

// A vertex: squared distances to the planes of its triangles, weighted by area, with those of the planes that
// hold its borders and seams; and the area. Two cache lines.
struct alignas(64) Corner {
    Quadric shape;
    double area = 0;
    Vec at;
};

struct Memory {
    std::vector<Corner> corners; // (vertices)
    std::vector<double> area;    // (wedges)
    std::vector<Quadric> drift; // (wedges) squared attributes by their weights; empty where all weigh nothing
    std::vector<Slope> slopes;  // (wedges, a)
    std::vector<double> squares; // (a) weights squared
    std::size_t width = 0;       // a
};

Memory remember(const Input &input, const Surface &surface);

} // namespace paradize::simplify
