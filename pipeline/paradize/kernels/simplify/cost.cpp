#include "simplify/cost.hpp"

#include <algorithm>

namespace paradize::simplify {

namespace {

// How much a plane that holds a border, or a seam, weighs beside an area of the edge's length squared.
constexpr double border_weight = 10.0;
constexpr double seam_weight = 1.0;
// The same beside the area of the edge's triangle, at most: the long edges of thin boxes would hold their
// narrow sides harder than their broad ones, and planks would lose their width before their thickness.
constexpr double most_of_triangle = 3.0;

Vec position(const Input &input, std::uint32_t source) {
    return {input.positions[3 * source], input.positions[3 * source + 1], input.positions[3 * source + 2]};
}

// The plane through an edge at right angles to its triangle, for both ends of the edge.
void add_border_plane(Quadrics &quadrics, const Surface &surface, std::uint32_t h, double weight) {
    VertexQuadric &a = quadrics.vertices[surface.at(h).vertex];
    VertexQuadric &b = quadrics.vertices[surface.at(next(h)).vertex];
    const VertexQuadric &c = quadrics.vertices[surface.at(previous(h)).vertex];
    const Vec along = b.at - a.at;
    const Vec up = cross(along, c.at - a.at);
    const Vec n = unit(cross(up, along));
    weight *= std::min(dot(along, along), most_of_triangle * 0.5 * length(up));
    Quadric plane;
    plane.add(n, -dot(n, a.at), weight);
    a.all += plane;
    b.all += plane;
}

// How strongly the seam between two wedges' attributes is held: fully where texture coordinates or groups
// part, as far as they turn where only unit vectors do.
double seam_strength(const Input &input, const Surface &surface, std::uint32_t h) {
    const std::uint32_t t = surface.at(h).twin;
    if (input.group[surface.triangle[triangle_of(h)].source] !=
        input.group[surface.triangle[triangle_of(t)].source]) {
        return 1.0;
    }
    const std::size_t width = input.weights.size();
    double turned = 0.0;
    for (const auto &[a, b] : {std::pair{h, next(t)}, std::pair{next(h), t}}) {
        const float *left = input.attributes.data() + surface.source[surface.at(a).wedge] * width;
        const float *right = input.attributes.data() + surface.source[surface.at(b).wedge] * width;
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

// Shapes, areas, and sums of area times gradient.
void add_triangle(Quadrics &quadrics, const Input &input, const Surface &surface, const Triangle &triangle) {
    const std::size_t width = quadrics.width;
    VertexQuadric *corners[3];
    Float4 *wedges[3];
    std::uint32_t source[3];
    for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = &quadrics.vertices[triangle.half[k].vertex];
        wedges[k] = quadrics.wedge(triangle.half[k].wedge);
        source[k] = surface.source[triangle.half[k].wedge];
    }
    const Vec a = corners[0]->at;
    const Vec ab = corners[1]->at - a;
    const Vec ac = corners[2]->at - a;
    const Vec n = cross(ab, ac);
    const double twice = length(n);
    if (!(twice > 0)) {
        return;
    }
    const Vec up = (1.0 / twice) * n;
    const double area = 0.5 * twice;
    Quadric plane;
    plane.add(up, -dot(up, a), area);
    for (std::size_t k = 0; k < 3; ++k) {
        corners[k]->all += plane;
        wedges[k][0] += Float4{static_cast<float>(area), 0, 0, 0};
    }
    // Gradients of the barycentric coordinates of b and c.
    const Vec gb = (1.0 / twice) * cross(ac, up);
    const Vec gc = (1.0 / twice) * cross(up, ab);
    const float *rows[3];
    for (std::size_t k = 0; k < 3; ++k) {
        rows[k] = input.attributes.data() + source[k] * width;
    }
    Quadric drift; // of a place beside the corner: the corner's own value is the same in all its triangles
    for (std::size_t k = 0; k < width; ++k) {
        const double db = static_cast<double>(rows[1][k]) - rows[0][k];
        const double dc = static_cast<double>(rows[2][k]) - rows[0][k];
        const Vec g = db * gb + dc * gc;
        const Float4 slope{static_cast<float>(area * g.x), static_cast<float>(area * g.y),
                           static_cast<float>(area * g.z), 0};
        for (Float4 *wedge : wedges) {
            wedge[k + 1] += slope;
        }
        drift.add_square(g, area * quadrics.squares[k]);
    }
    if (quadrics.weighed) {
        for (VertexQuadric *corner : corners) {
            drift.x = drift.y = drift.z = drift.c = 0;
            drift.look_from(-1.0 * corner->at);
            corner->all += drift;
        }
    }
}

// Sums become means; what the mean explains is no drift.
void close_wedges(Quadrics &quadrics, const Input &input, const Surface &surface) {
    for (const Triangle &triangle : surface.triangle) {
        for (const Half &half : triangle.half) {
            Float4 *wedge = quadrics.wedge(half.wedge);
            if (wedge[0][1] != 0) {
                continue;
            }
            wedge[0][1] = at_source;
            const double area = wedge[0][0];
            const double share = area > 0 ? 1.0 / area : 0.0;
            const float *values = input.attributes.data() + surface.source[half.wedge] * quadrics.width;
            Quadric drift;
            for (std::size_t k = 0; k < quadrics.width; ++k) {
                Float4 &mean = wedge[k + 1];
                const Vec g = share * Vec{mean[0], mean[1], mean[2]};
                drift.add_square(g, -area * quadrics.squares[k]);
                mean = Float4{static_cast<float>(g.x), static_cast<float>(g.y), static_cast<float>(g.z),
                              values[k]};
            }
            if (quadrics.weighed) {
                VertexQuadric &corner = quadrics.vertices[half.vertex];
                drift.look_from(-1.0 * corner.at);
                corner.all += drift;
            }
        }
    }
}

} // namespace

Quadrics initial_quadrics(const Input &input, const Surface &surface) {
    Quadrics quadrics;
    quadrics.width = input.weights.size();
    quadrics.stride = quadrics.width + 1;
    for (const float weight : input.weights) {
        quadrics.squares.push_back(weight * weight);
        quadrics.weighed = quadrics.weighed || quadrics.squares.back() > 0;
    }
    quadrics.vertices.resize(surface.vertices());
    quadrics.wedges.resize(surface.wedges() * quadrics.stride);
    for (std::uint32_t v = 0; v < surface.vertices(); ++v) {
        quadrics.vertices[v].at = position(input, surface.source[surface.at(surface.first[v]).wedge]);
    }
    for (const Triangle &triangle : surface.triangle) {
        add_triangle(quadrics, input, surface, triangle);
    }
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        for (std::uint32_t h = 4 * t; h < 4 * t + 3; ++h) {
            const Half &half = surface.at(h);
            if (half.twin == none) {
                add_border_plane(quadrics, surface, h, border_weight);
            } else if (half.wedge != surface.at(next(half.twin)).wedge ||
                       surface.at(next(h)).wedge != surface.at(half.twin).wedge) {
                const double strength = seam_strength(input, surface, h);
                if (strength > 0.0) {
                    add_border_plane(quadrics, surface, h, seam_weight * strength);
                }
            }
        }
    }
    close_wedges(quadrics, input, surface);
    return quadrics;
}

} // namespace paradize::simplify
