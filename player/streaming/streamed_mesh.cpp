#include "streaming/streamed_mesh.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"

#include <epoxy/gl.h>
#include <glm/common.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace paradize {

namespace {

constexpr std::array<int, assets::mesh_attributes> components{3, 3, 4, 2, 2, 4, 2};

} // namespace

void attach_attribute(const assets::GlbFormat &format, std::uint32_t part, const gl::Buffer &vertices,
                      std::size_t offset_bytes) {
    gl::attribute_numbers(part, components[part], format.component, format.normalized, vertices,
                          static_cast<int>(format.stride), offset_bytes);
}

glm::dmat4 model_of(const assets::QuantisationGrid &grid) {
    const glm::dvec3 step(grid.step[0], grid.step[1], grid.step[2]);
    const glm::dvec3 origin(grid.origin[0], grid.origin[1], grid.origin[2]);
    return glm::scale(glm::translate(glm::dmat4(1.0), origin), step);
}

std::size_t attribute_end(std::size_t offset_bytes, std::size_t bytes) {
    return (offset_bytes + bytes + 15) & ~std::size_t{15};
}

StreamedMesh::StreamedMesh(const assets::Glb &glb)
    : materials_(glb.materials), measures_(glb.measures), grid_(glb.grid) {
    for (const assets::GlbLevel &level : glb.levels) {
        MeshLevel &made = levels_.emplace_back();
        low_ = glm::min(low_, glm::vec3(level.low[0], level.low[1], level.low[2]));
        high_ = glm::max(high_, glm::vec3(level.high[0], level.high[1], level.high[2]));
        std::vector<std::size_t> &offsets = offsets_.emplace_back();
        for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
            offsets.push_back(made.vertex_bytes);
            made.vertex_bytes = attribute_end(made.vertex_bytes, mesh_attribute(level, part).size());
        }
        made.has_uv1 = !level.uvs1.empty();
        for (const assets::GlbPrimitive &primitive : level.primitives) {
            offsets.push_back(made.index_bytes);
            made.primitives.push_back(
                {static_cast<int>(primitive.material), static_cast<int>(primitive.count), made.index_bytes});
            made.index_bytes = attribute_end(made.index_bytes, primitive.indices.size());
        }
        made.index_type = level.index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
    }
}

void StreamedMesh::begin(const assets::Glb &glb, std::uint32_t level) {
    MeshLevel &made = levels_[level];
    made.vertex_array = gl::VertexArray::create();
    glBindVertexArray(made.vertex_array.name());
    made.vertices = gl::make_buffer(GL_ARRAY_BUFFER, made.vertex_bytes, gl::Usage::fixed);
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        if (!mesh_attribute(glb.levels[level], part).empty()) {
            attach_attribute(glb.levels[level].formats[part], part, made.vertices, offsets_[level][part]);
        }
    }
    made.indices = gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, made.index_bytes, gl::Usage::fixed);
    glBindVertexArray(0);
}

void StreamedMesh::upload(const assets::UploadChunk &chunk, const std::byte *bytes) {
    const MeshLevel &made = levels_[chunk.level];
    const bool indices = chunk.part >= assets::mesh_attributes;
    // A copy target leaves the element buffer of the bound vertex array unchanged.
    gl::write_buffer(GL_COPY_WRITE_BUFFER, indices ? made.indices : made.vertices,
                     offsets_[chunk.level][chunk.part] + chunk.offset, {bytes, chunk.bytes.size()});
}

void StreamedMesh::evict(std::uint32_t level) {
    MeshLevel &made = levels_[level];
    made.resident = false;
    made.vertex_array = {};
    made.vertices = {};
    made.indices = {};
}

int StreamedMesh::best_level(int wanted) const {
    const int count = static_cast<int>(levels_.size());
    for (int level = wanted; level < count; ++level) {
        if (levels_[static_cast<std::size_t>(level)].resident) {
            return level;
        }
    }
    for (int level = std::min(wanted, count) - 1; level >= 0; --level) {
        if (levels_[static_cast<std::size_t>(level)].resident) {
            return level;
        }
    }
    return -1;
}

void StreamedMesh::bind(int level, const gl::Buffer &instances, std::size_t first) const {
    constexpr unsigned rows = 4; // InstanceRows
    constexpr std::size_t row_bytes = 4 * sizeof(float);
    glBindVertexArray(levels_[static_cast<std::size_t>(level)].vertex_array.name());
    for (unsigned row = 0; row < rows; ++row) {
        gl::attribute_floats(gl::attribute_model + row, 4, instances, static_cast<int>(rows * row_bytes),
                             (first * rows + row) * row_bytes, 1);
    }
}

void StreamedMesh::draw(int level, std::size_t material, int instances) const {
    const MeshLevel &mesh = levels_[static_cast<std::size_t>(level)];
    for (const MeshPrimitive &primitive : mesh.primitives) {
        if (primitive.material == static_cast<int>(material)) {
            gl::draw_triangles(primitive.index_count, mesh.index_type, primitive.index_offset, instances);
        }
    }
}

} // namespace paradize
