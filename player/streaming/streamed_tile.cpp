#include "streaming/streamed_tile.hpp"

#include "error.hpp"
#include "gl/buffer.hpp"
#include "streaming/streamed_mesh.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <utility>

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
                           const std::string &path, std::shared_ptr<GeometryPool> pool)
    : pool_(std::move(pool)) {
    const assets::GlbLevel &first = glb.levels.front();
    ranges_.reserve(glb.levels.size());
    blocks_.reserve(pieces.size()); // the pool keeps the addresses of their slots
    pool_->reserve(pieces.size());
    const auto height_m = [&](float y) {
        return static_cast<float>(glb.grid.origin[1] + glb.grid.step[1] * y);
    };
    std::size_t vertices = 0;
    std::size_t indices = 0;
    for (const assets::Piece &piece : pieces) {
        const auto index = static_cast<std::uint32_t>(blocks_.size());
        TileBlock &block = blocks_.emplace_back();
        block.first_patch = piece.first_level;
        block.patches = piece.levels;
        for (std::uint32_t i = piece.first_level; i < piece.first_level + piece.levels; ++i) {
            const assets::GlbLevel &level = glb.levels[i];
            check_same_layout(glb, level, path);
            const assets::GlbPrimitive &primitive = level.primitives.front();
            ranges_.push_back({index, static_cast<int>(primitive.count), block.indices, block.vertices,
                               height_m(level.low[1]), height_m(level.high[1])});
            block.vertices += level.vertices;
            block.indices += primitive.count;
        }
        vertices += block.vertices;
        indices += block.indices;
    }
    for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
        layout_.vertex_bytes[part] = vertex_bytes(first, part);
    }
    layout_.formats = first.formats;
    layout_.index_bytes = first.index_bytes;
    indices_per_vertex_ =
        static_cast<double>(indices) / static_cast<double>(std::max(vertices, std::size_t{1}));
    model_ = model_of(glb.grid);
}

StreamedTile &StreamedTile::operator=(StreamedTile &&other) noexcept {
    if (this != &other) {
        release_all();
        pool_ = std::move(other.pool_);
        layout_ = other.layout_;
        indices_per_vertex_ = other.indices_per_vertex_;
        blocks_ = std::move(other.blocks_);
        ranges_ = std::move(other.ranges_);
        model_ = other.model_;
    }
    return *this;
}

StreamedTile::~StreamedTile() {
    release_all();
}

void StreamedTile::release_all() {
    for (std::uint32_t block = 0; block < blocks_.size(); ++block) {
        if (blocks_[block].slot.page != nullptr) {
            evict(block);
        }
    }
}

void StreamedTile::begin(std::uint32_t block) {
    TileBlock &made = blocks_[block];
    pool_->take(made.slot, layout_, made.vertices, made.indices, indices_per_vertex_);
}

void StreamedTile::upload(const assets::Glb &glb, const assets::UploadChunk &chunk, const gl::Source &from) {
    const assets::GlbLevel &level = glb.levels[chunk.level];
    const PatchRange &range = ranges_[chunk.level];
    const GeometrySlot &slot = blocks_[range.block].slot;
    const GeometryPage &page = *slot.page;
    // A copy target leaves the element buffer of the bound vertex array unchanged.
    if (chunk.part >= assets::mesh_attributes) {
        gl::write_buffer(GL_COPY_WRITE_BUFFER, page.indices,
                         (slot.first_index + range.first_index) * layout_.index_bytes + chunk.offset, from,
                         chunk.bytes.size());
    } else {
        const std::size_t before = (slot.first_vertex + range.first_vertex) * vertex_bytes(level, chunk.part);
        gl::write_buffer(GL_COPY_WRITE_BUFFER, page.vertices,
                         page.attribute_offsets[chunk.part] + before + chunk.offset, from,
                         chunk.bytes.size());
    }
}

void StreamedTile::evict(std::uint32_t block) {
    TileBlock &made = blocks_[block];
    made.resident = false;
    pool_->release(made.slot);
}

} // namespace paradize
