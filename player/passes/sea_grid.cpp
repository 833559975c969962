#include "passes/sea_grid.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"
#include "scene/near_waves.hpp"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace paradize {

namespace {

constexpr int grid_steps = 24; // cells along an edge of a flat sea

/// Returns the grid's lines by their distance from the middle, metres: dense near the eye, the last one at
/// `reach_m`.
std::vector<float> flat_lines(float reach_m) {
    std::vector<float> lines;
    for (int i = 0; i <= grid_steps; ++i) {
        const float t = 2.0F * static_cast<float>(i) / static_cast<float>(grid_steps) - 1.0F;
        lines.push_back(reach_m * t * t * t);
    }
    return lines;
}

/// The same with cells as fine as waves need: even ones near the eye, then wider in proportion to the
/// distance, because shorter waves have faded out there, and far wider where all have. All lines run
/// through, so that no edge meets the middle of another and the surface has no cracks.
std::vector<float> wave_lines(float wave_length_m, float reach_m) {
    std::vector<float> half{0.0F};
    while (half.back() < reach_m) {
        const float at_m = half.back();
        const bool has_waves = at_m < fade_lengths * wave_length_m;
        const float step_m = std::max(wave_length_m / cells_per_wave, at_m * (has_waves ? 0.3F : 3.0F));
        half.push_back(std::min(at_m + step_m, reach_m));
    }
    std::vector<float> lines;
    for (auto line = half.rbegin(); line + 1 != half.rend(); ++line) {
        lines.push_back(-*line);
    }
    lines.insert(lines.end(), half.begin(), half.end());
    return lines;
}

constexpr int indices_per_cell = 6;

} // namespace

SeaGrid SeaGrid::flat(float reach_m) {
    return SeaGrid(flat_lines(reach_m));
}

SeaGrid SeaGrid::with_waves(float wave_length_m, float reach_m) {
    return SeaGrid(wave_lines(wave_length_m, reach_m));
}

SeaGrid::SeaGrid(std::vector<float> lines)
    : lines_(std::move(lines)), vertex_array_(gl::VertexArray::create()) {
    const int last = static_cast<int>(lines_.size()) - 1;
    std::vector<glm::vec3> points;
    std::vector<std::uint16_t> triangles;
    for (int z = 0; z <= last; ++z) {
        for (int x = 0; x <= last; ++x) {
            points.emplace_back(lines_[static_cast<std::size_t>(x)], 0.0F,
                                lines_[static_cast<std::size_t>(z)]);
            if (x == last || z == last) {
                continue;
            }
            const int corner = z * (last + 1) + x;
            for (int offset : {0, last + 1, 1, 1, last + 1, last + 2}) {
                triangles.push_back(static_cast<std::uint16_t>(corner + offset));
            }
        }
    }
    glBindVertexArray(vertex_array_.name());
    vertices_ = gl::make_buffer(GL_ARRAY_BUFFER, points.size() * sizeof(points[0]), gl::Usage::fixed);
    gl::write_buffer(GL_ARRAY_BUFFER, vertices_, 0, std::as_bytes(std::span(points)));
    gl::attribute_floats(gl::attribute_position, 3, vertices_, sizeof(glm::vec3), 0);
    indices_ =
        gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, triangles.size() * sizeof(triangles[0]), gl::Usage::fixed);
    gl::write_buffer(GL_ELEMENT_ARRAY_BUFFER, indices_, 0, std::as_bytes(std::span(triangles)));
    glBindVertexArray(0);
    counts_.resize(lines_.size());
    base_vertices_.assign(lines_.size(), 0);
    offsets_.resize(lines_.size());
}

void SeaGrid::draw(const View &view, const glm::vec2 &center, float half_size_m, float level_m,
                   float rise_m) {
    const glm::vec2 anchor(view.anchor.x, view.anchor.z);
    const auto corner = [&](std::size_t x, std::size_t z) {
        return glm::clamp(center + glm::vec2(lines_[x], lines_[z]), -half_size_m - anchor,
                          half_size_m - anchor);
    };
    const auto sees = [&](std::size_t x, std::size_t z) {
        const glm::vec2 low = corner(x, z);
        const glm::vec2 high = corner(x + 1, z + 1);
        const glm::vec2 middle = 0.5F * (low + high);
        // Points of waves run in circles.
        return view.sees({middle.x, level_m, middle.y}, 0.5F * glm::distance(low, high) + 2.0F * rise_m);
    };
    const std::size_t cells = lines_.size() - 1;
    std::size_t runs = 0;
    for (std::size_t z = 0; z < cells; ++z) {
        std::size_t first = 0;
        std::size_t end = cells;
        // A view is convex, so that it sees one run of a row.
        while (first < end && !sees(first, z)) {
            ++first;
        }
        while (end > first && !sees(end - 1, z)) {
            --end;
        }
        if (first == end) {
            continue;
        }
        counts_[runs] = static_cast<int>(end - first) * indices_per_cell;
        offsets_[runs] =
            reinterpret_cast<const void *>((z * cells + first) * indices_per_cell * sizeof(std::uint16_t));
        ++runs;
    }
    if (runs == 0) {
        return;
    }
    glBindVertexArray(vertex_array_.name());
    gl::draw_triangle_ranges(std::span(counts_).first(runs), GL_UNSIGNED_SHORT,
                             std::span(offsets_).first(runs), std::span(base_vertices_).first(runs));
    glBindVertexArray(0);
}

} // namespace paradize
