#include "streaming/streamed_tile.hpp"

#include "error.hpp"
#include "gl/buffer.hpp"
#include "streaming/streamed_mesh.hpp"

#include <epoxy/gl.h>

namespace paradize {

namespace {

std::size_t vertex_bytes(const assets::GlbLevel &level, std::uint32_t part) {
    return mesh_attribute(level, part).size() / level.vertices;
}

void check_same_layout(const assets::Glb &glb, const assets::GlbLevel &level, const std::string &path) {
    const assets::GlbLevel &first = glb.levels.front();
    const auto refuse = [&](const std::string &what) {
        throw Error(path + ": node " + level.name + ": " + what);
    };
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        if (vertex_bytes(level, part) != vertex_bytes(first, part) ||
            level.formats[part] != first.formats[part]) {
            refuse("its attributes differ from those of node " + first.name);
        }
    }
    if (level.index_bytes != first.index_bytes) {
        refuse("its index type differs from that of node " + first.name);
    }
    if (level.primitives.size() != 1) {
        refuse("has " + std::to_string(level.primitives.size()) + " primitives, must have one");
    }
}

} // namespace

StreamedTile::StreamedTile(const assets::Glb &glb, const std::string &path) {
    std::size_t vertices = 0;
    std::size_t index_bytes = 0;
    ranges_.reserve(glb.levels.size());
    for (const assets::GlbLevel &level : glb.levels) {
        check_same_layout(glb, level, path);
        const assets::GlbPrimitive &primitive = level.primitives.front();
        ranges_.push_back({static_cast<int>(primitive.count), index_bytes, static_cast<int>(vertices)});
        vertices += level.vertices;
        index_bytes += primitive.indices.size();
    }
    const assets::GlbLevel &first = glb.levels.front();
    std::size_t bytes = 0;
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        attribute_offsets_.push_back(bytes);
        bytes = attribute_end(bytes, vertices * vertex_bytes(first, part));
    }
    model_ = model_of(glb.grid);
    vertex_array_ = gl::VertexArray::create();
    glBindVertexArray(vertex_array_.name());
    vertices_ = gl::make_buffer(GL_ARRAY_BUFFER, bytes, gl::Usage::fixed);
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        attach_attribute(first, part, vertices_, attribute_offsets_[part]);
    }
    indices_ = gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, index_bytes, gl::Usage::fixed);
    index_type_ = first.index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
    glBindVertexArray(0);
}

void StreamedTile::upload(const assets::Glb &glb, const assets::UploadChunk &chunk) {
    const assets::GlbLevel &level = glb.levels[chunk.level];
    const PatchRange &range = ranges_[chunk.level];
    if (chunk.part >= assets::mesh_attributes) {
        // A copy target leaves the element buffer of the bound vertex array unchanged.
        gl::write_buffer(GL_COPY_WRITE_BUFFER, indices_, range.index_offset + chunk.offset, chunk.bytes);
    } else {
        const std::size_t before =
            static_cast<std::size_t>(range.base_vertex) * vertex_bytes(level, chunk.part);
        gl::write_buffer(GL_COPY_WRITE_BUFFER, vertices_,
                         attribute_offsets_[chunk.part] + before + chunk.offset, chunk.bytes);
    }
    if (chunk.last) {
        resident_patches_ = chunk.level + 1;
    }
}

} // namespace paradize
