#include "simplify_cost.hpp"

#include <algorithm>

namespace paradize::simplify {

namespace {

// How much a plane that holds a border, or a seam, weighs beside an area of the edge's length squared.
constexpr double border_weight = 10.0;
constexpr double seam_weight = 1.0;

Vec position(const Input &input, std::uint32_t source) {
    return {input.positions[3 * source], input.positions[3 * source + 1], input.positions[3 * source + 2]};
}

// The plane through an edge at right angles to its triangle, for both ends of the edge.
void hold(Memory &memory, const Surface &surface, std::uint32_t h, double weight) {
    Corner &a = memory.corners[surface.vertex[h]];
    Corner &b = memory.corners[surface.vertex[next(h)]];
    const Corner &c = memory.corners[surface.vertex[previous(h)]];
    const Vec along = b.at - a.at;
    const Vec n = unit(cross(cross(along, c.at - a.at), along));
    weight *= dot(along, along);
    Quadric plane;
    plane.add(n, -dot(n, a.at), weight);
    a.shape += plane;
    b.shape += plane;
}

// How strongly the seam between two wedges' attributes is held: fully where texture coordinates or groups
// part, as far as they turn where only unit vectors do.
double jump(const Input &input, const Surface &surface, std::uint32_t h) {
    const std::uint32_t t = surface.twin[h];
    if (input.group[surface.triangle[h / 3]] != input.group[surface.triangle[t / 3]]) {
        return 1.0;
    }
    const std::size_t width = input.weights.size();
    double turned = 0.0;
    for (const auto &[a, b] : {std::pair{h, next(t)}, std::pair{next(h), t}}) {
        const float *left = input.attributes.data() + surface.source[surface.wedge[a]] * width;
        const float *right = input.attributes.data() + surface.source[surface.wedge[b]] * width;
        for (std::size_t k = 0; k < width; ++k) {
            const double gap = static_cast<double>(left[k]) - right[k];
            const auto column = static_cast<std::ptrdiff_t>(k);
            if (input.unit >= 0 && column >= input.unit && column < input.unit + 3) {
                turned += gap * gap / 8.0;
            } else if (gap != 0.0) {
                return 1.0;
            }
        }
    }
    return std::min(turned, 1.0);
}

} // namespace

Memory remember(const Input &input, const Surface &surface) {
    Memory memory;
    const std::size_t width = memory.width = input.weights.size();
    bool weighed = false;
    for (const float weight : input.weights) {
        memory.squares.push_back(static_cast<double>(weight) * weight);
        weighed = weighed || weight != 0.0F;
    }
    memory.corners.resize(surface.vertices());
    memory.area.resize(surface.wedges());
    memory.drift.resize(weighed ? surface.wedges() : 0);
    memory.slopes.resize(surface.wedges() * width);
    for (std::uint32_t v = 0; v < surface.vertices(); ++v) {
        memory.corners[v].at = position(input, surface.source[surface.wedge[surface.leaving[v]]]);
    }
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        const std::uint32_t *v = &surface.vertex[3 * t];
        const std::uint32_t *w = &surface.wedge[3 * t];
        const Vec a = memory.corners[v[0]].at;
        const Vec ab = memory.corners[v[1]].at - a;
        const Vec ac = memory.corners[v[2]].at - a;
        const Vec n = cross(ab, ac);
        const double twice = length(n);
        if (!(twice > 0)) {
            continue;
        }
        const Vec up = (1.0 / twice) * n;
        const double area = 0.5 * twice;
        Quadric plane;
        plane.add(up, -dot(up, a), area);
        for (std::size_t k = 0; k < 3; ++k) {
            memory.corners[v[k]].shape += plane;
            memory.corners[v[k]].area += area;
            memory.area[w[k]] += area;
        }
        // Gradients of the barycentric coordinates of b and c.
        const Vec gb = (1.0 / twice) * cross(ac, up);
        const Vec gc = (1.0 / twice) * cross(up, ab);
        Quadric drift;
        for (std::size_t k = 0; k < width; ++k) {
            const double base = input.attributes[surface.source[w[0]] * width + k];
            const double db = input.attributes[surface.source[w[1]] * width + k] - base;
            const double dc = input.attributes[surface.source[w[2]] * width + k] - base;
            const Vec g = db * gb + dc * gc;
            const double d = base - dot(g, a);
            const Slope slope{area * g.x, area * g.y, area * g.z, area * d};
            for (std::size_t i = 0; i < 3; ++i) {
                memory.slopes[w[i] * width + k] += slope;
            }
            drift.add(g, d, area * memory.squares[k]);
        }
        if (weighed) {
            for (std::size_t i = 0; i < 3; ++i) {
                memory.drift[w[i]] += drift;
            }
        }
    }
    for (std::uint32_t h = 0; h < surface.vertex.size(); ++h) {
        const std::uint32_t t = surface.twin[h];
        if (t == none) {
            hold(memory, surface, h, border_weight);
        } else if (surface.wedge[h] != surface.wedge[next(t)] || surface.wedge[next(h)] != surface.wedge[t]) {
            const double strength = jump(input, surface, h);
            if (strength > 0.0) {
                hold(memory, surface, h, seam_weight * strength);
            }
        }
    }
    return memory;
}

} // namespace paradize::simplify
