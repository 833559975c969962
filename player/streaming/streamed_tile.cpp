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

StreamedTile::StreamedTile(const assets::Glb &glb, std::span<const assets::Piece> pieces,
                           const std::string &path) {
    const assets::GlbLevel &first = glb.levels.front();
    ranges_.reserve(glb.levels.size());
    const auto height_m = [&](float y) {
        return static_cast<float>(glb.grid.origin[1] + glb.grid.step[1] * y);
    };
    for (const assets::Piece &piece : pieces) {
        const auto index = static_cast<std::uint32_t>(blocks_.size());
        TileBlock &block = blocks_.emplace_back();
        block.first_patch = piece.first_level;
        block.patches = piece.levels;
        std::size_t vertices = 0;
        for (std::uint32_t i = piece.first_level; i < piece.first_level + piece.levels; ++i) {
            const assets::GlbLevel &level = glb.levels[i];
            check_same_layout(glb, level, path);
            const assets::GlbPrimitive &primitive = level.primitives.front();
            ranges_.push_back({index, static_cast<int>(primitive.count), block.index_bytes,
                               static_cast<int>(vertices), height_m(level.low[1]), height_m(level.high[1])});
            vertices += level.vertices;
            block.index_bytes += primitive.indices.size();
        }
        for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
            block.attribute_offsets[part] = block.vertex_bytes;
            block.vertex_bytes = attribute_end(block.vertex_bytes, vertices * vertex_bytes(first, part));
        }
    }
    model_ = model_of(glb.grid);
    index_type_ = first.index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
}

void StreamedTile::begin(const assets::Glb &glb, std::uint32_t block) {
    TileBlock &made = blocks_[block];
    made.vertex_array = gl::VertexArray::create();
    glBindVertexArray(made.vertex_array.name());
    made.vertices = gl::make_buffer(GL_ARRAY_BUFFER, made.vertex_bytes, gl::Usage::fixed);
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        attach_attribute(glb.levels.front(), part, made.vertices, made.attribute_offsets[part]);
    }
    made.indices = gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, made.index_bytes, gl::Usage::fixed);
    glBindVertexArray(0);
}

void StreamedTile::upload(const assets::Glb &glb, const assets::UploadChunk &chunk, const std::byte *bytes) {
    const assets::GlbLevel &level = glb.levels[chunk.level];
    const PatchRange &range = ranges_[chunk.level];
    const TileBlock &block = blocks_[range.block];
    const std::span<const std::byte> data(bytes, chunk.bytes.size());
    // A copy target leaves the element buffer of the bound vertex array unchanged.
    if (chunk.part >= assets::mesh_attributes) {
        gl::write_buffer(GL_COPY_WRITE_BUFFER, block.indices, range.index_offset + chunk.offset, data);
    } else {
        const std::size_t before =
            static_cast<std::size_t>(range.base_vertex) * vertex_bytes(level, chunk.part);
        gl::write_buffer(GL_COPY_WRITE_BUFFER, block.vertices,
                         block.attribute_offsets[chunk.part] + before + chunk.offset, data);
    }
}

void StreamedTile::evict(std::uint32_t block) {
    TileBlock &made = blocks_[block];
    made.resident = false;
    made.vertex_array = {};
    made.vertices = {};
    made.indices = {};
}

} // namespace paradize
