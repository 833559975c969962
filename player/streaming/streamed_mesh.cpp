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

StreamedMesh::StreamedMesh(const assets::Glb &glb, std::shared_ptr<GeometryPool> pool)
    : pool_(std::move(pool)), materials_(glb.materials), measures_(glb.measures), grid_(glb.grid) {
    pool_->reserve(glb.levels.size());
    for (const assets::GlbLevel &level : glb.levels) {
        MeshLevel &made = levels_.emplace_back();
        made.node = level.name;
        low_ = glm::min(low_, glm::vec3(level.low[0], level.low[1], level.low[2]));
        high_ = glm::max(high_, glm::vec3(level.high[0], level.high[1], level.high[2]));
        made.vertices = level.vertices;
        for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
            if (!mesh_attribute(level, part).empty()) {
                made.layout.vertex_bytes[part] = level.formats[part].stride;
                made.layout.formats[part] = level.formats[part];
            }
        }
        made.layout.index_bytes = level.index_bytes;
        made.has_uv1 = !level.uvs1.empty();
        for (const assets::GlbPrimitive &primitive : level.primitives) {
            made.primitives.push_back({static_cast<int>(primitive.material), primitive.count,
                                       static_cast<std::uint32_t>(made.indices)});
            made.indices += primitive.count;
        }
    }
}

StreamedMesh &StreamedMesh::operator=(StreamedMesh &&other) noexcept {
    if (this != &other) {
        release_all();
        pool_ = std::move(other.pool_);
        levels_ = std::move(other.levels_);
        materials_ = std::move(other.materials_);
        measures_ = std::move(other.measures_);
        grid_ = other.grid_;
        low_ = other.low_;
        high_ = other.high_;
    }
    return *this;
}

StreamedMesh::~StreamedMesh() {
    release_all();
}

void StreamedMesh::release_all() {
    for (std::uint32_t level = 0; level < levels_.size(); ++level) {
        if (levels_[level].slot.page != nullptr) {
            evict(level);
        }
    }
}

void StreamedMesh::expect() const {
    for (const MeshLevel &level : levels_) {
        pool_->expect(level.layout, level.vertices, level.indices);
    }
}

void StreamedMesh::begin(std::uint32_t level) {
    MeshLevel &made = levels_[level];
    pool_->take(made.slot, made.layout, made.vertices, made.indices, 0.0);
}

void StreamedMesh::upload(const assets::UploadChunk &chunk, const gl::Source &from) {
    const MeshLevel &made = levels_[chunk.level];
    const GeometryPage &page = *made.slot.page;
    // A copy target leaves the element buffer of the bound vertex array unchanged.
    if (chunk.part >= assets::mesh_attributes) {
        const std::size_t first =
            made.slot.first_index + made.primitives[chunk.part - assets::mesh_attributes].first_index;
        gl::write_buffer(GL_COPY_WRITE_BUFFER, page.indices, first * made.layout.index_bytes + chunk.offset,
                         from, chunk.bytes.size());
    } else {
        const std::size_t before = made.slot.first_vertex * made.layout.vertex_bytes[chunk.part];
        gl::write_buffer(GL_COPY_WRITE_BUFFER, page.vertices,
                         page.attribute_offsets[chunk.part] + before + chunk.offset, from,
                         chunk.bytes.size());
    }
}

void StreamedMesh::evict(std::uint32_t level) {
    MeshLevel &made = levels_[level];
    made.resident = false;
    pool_->release(made.slot);
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

void bind_page(const GeometryPage &page, const gl::Buffer &instances, std::size_t first) {
    constexpr unsigned rows = 4; // InstanceRows
    constexpr std::size_t row_bytes = 4 * sizeof(float);
    glBindVertexArray(page.vertex_array.name());
    for (unsigned row = 0; row < rows; ++row) {
        gl::attribute_floats(gl::attribute_model + row, 4, instances, static_cast<int>(rows * row_bytes),
                             (first * rows + row) * row_bytes, 1);
    }
}

} // namespace paradize
