// Writes the remaining mesh, numbered anew.
#include "simplify/work.hpp"

namespace paradize::simplify {

namespace {

void write_attributes(const Work &work, Result &result, std::uint32_t w) {
    const Input &input = work.input;
    const std::size_t width = work.quadrics.width;
    const Float4 *wedge = work.quadrics.wedge(w);
    const bool moved = wedge[0][1] == moved_on && wedge[0][0] > 0;
    const float *source = input.attributes.data() + work.surface.source[w] * width;
    const std::size_t first = result.attributes.size();
    for (std::size_t k = 0; k < width; ++k) {
        result.attributes.push_back(moved ? wedge[k + 1][3] : source[k]);
    }
    if (!moved || input.unit < 0) {
        return;
    }
    const auto column = static_cast<std::size_t>(input.unit);
    float *n = result.attributes.data() + first + column;
    const Vec direction = mesh::unit(Vec{n[0], n[1], n[2]});
    if (direction == Vec{}) {
        for (std::size_t k = 0; k < 3; ++k) {
            n[k] = source[column + k];
        }
        return;
    }
    n[0] = static_cast<float>(direction.x);
    n[1] = static_cast<float>(direction.y);
    n[2] = static_cast<float>(direction.z);
}

} // namespace

void write(const Work &work, Result &result) {
    const Surface &surface = work.surface;
    result.triangles.reserve(3 * work.left);
    result.triangle.reserve(work.left);
    Numbers number(surface.wedges(), none);
    Numbers place(work.input.place.size(), none);
    std::uint32_t places = 0;
    for (const Triangle &triangle : surface.triangle) {
        if (triangle.alive == 0) {
            continue;
        }
        result.triangle.push_back(triangle.source);
        for (const Half &half : triangle.half) {
            if (number[half.wedge] == none) {
                number[half.wedge] = static_cast<std::uint32_t>(result.vertex.size());
                result.vertex.push_back(surface.source[half.wedge]);
                const Vec at = work.quadrics.vertices[half.vertex].at;
                result.positions.insert(result.positions.end(), {at.x, at.y, at.z});
                std::uint32_t &known = place[surface.source_place[half.vertex]];
                known = known == none ? places++ : known;
                result.place.push_back(known);
                write_attributes(work, result, half.wedge);
            }
            result.triangles.push_back(number[half.wedge]);
        }
    }
}

} // namespace paradize::simplify
