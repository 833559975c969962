#include "streaming/stream_item.hpp"

#include "gl/texture.hpp"
#include "streaming/texture_format.hpp"

#include <epoxy/gl.h>

#include <utility>

namespace paradize {

void StreamedTexture::bind(unsigned unit, unsigned sampler) const {
    gl::bind_texture(unit, target_, resident() ? texture_.name() : fallback_.name(), sampler);
}

StreamItem::StreamItem(const assets::Artifact &artifact, assets::LoadedArtifact opened,
                       const GeometryPools &pools)
    : loaded(std::move(opened)), kind(artifact.kind), max_level(artifact.max_level), drawn(artifact.drawn) {
    if (!drawn) {
        return;
    }
    if (loaded.tile) {
        tile = StreamedTile(loaded.glb, loaded.plan.pieces, loaded.path, pools.patches);
    } else if (kind == assets::ArtifactKind::mesh) {
        mesh = StreamedMesh(loaded.glb, pools.meshes);
    } else if (kind != assets::ArtifactKind::sound) {
        make_texture();
    }
    pieces_left = loaded.plan.pieces.size();
}

void StreamItem::make_texture() {
    StreamedTexture &out = texture;
    const assets::Ktx2 &ktx = loaded.ktx;
    check_support(ktx, loaded.path);
    out.target_ = ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
    out.width_px_ = static_cast<int>(ktx.levels[0].width_px);
    out.height_px_ = static_cast<int>(ktx.levels[0].height_px);
    out.levels_ = static_cast<int>(ktx.levels.size());
    out.has_green_ = assets::has_green(ktx.format);
    out.finest_ = out.levels_;
    out.fallback_ = neutral_texture(ktx);
}

void StreamItem::begin(std::uint32_t piece_index, bool all_follow) {
    const assets::Piece &piece = loaded.plan.pieces[piece_index];
    if (loaded.tile) {
        tile.begin(piece_index);
    } else if (kind == assets::ArtifactKind::mesh) {
        mesh.begin(piece.first_level);
    } else if (!texture.resident() || piece.first_level < texture.room_from_) {
        finer_from_ = all_follow ? 0 : piece.first_level;
        finer = allocate_texture(loaded.ktx, finer_from_, best_storage());
        if (texture.resident()) {
            copy_levels(loaded.ktx, {texture.texture_, texture.room_from_}, {finer, finer_from_});
        }
    }
}

void StreamItem::upload(const assets::UploadChunk &chunk, const gl::Source &from) {
    if (loaded.tile) {
        tile.upload(loaded.glb, chunk, from);
    } else if (kind == assets::ArtifactKind::mesh) {
        mesh.upload(chunk, from);
    } else {
        upload_rows(finer ? LevelsFrom{finer, finer_from_} : LevelsFrom{texture.texture_, texture.room_from_},
                    loaded.ktx, chunk, from);
    }
}

void StreamItem::finish(std::uint32_t piece_index) {
    const assets::Piece &piece = loaded.plan.pieces[piece_index];
    if (loaded.tile) {
        tile.finish(piece_index);
    } else if (kind == assets::ArtifactKind::mesh) {
        mesh.finish(piece.first_level);
    } else {
        if (finer) {
            texture.texture_ = std::move(finer);
            texture.room_from_ = finer_from_;
        }
        make_sampled(loaded.ktx, {texture.texture_, texture.room_from_}, piece.first_level, max_level);
        texture.finest_ = static_cast<int>(piece.first_level);
    }
    --pieces_left;
}

void StreamItem::evict(std::uint32_t piece_index, std::vector<std::byte> *held) {
    const assets::Piece &piece = loaded.plan.pieces[piece_index];
    if (loaded.tile) {
        tile.evict(piece_index);
    } else if (kind == assets::ArtifactKind::mesh) {
        mesh.evict(piece.first_level);
    } else {
        evict_mips(piece.first_level, piece.first_level + piece.levels, held);
    }
    ++pieces_left;
}

/// Keeps the mips from `coarser` on.
void StreamItem::evict_mips(std::uint32_t finest, std::uint32_t coarser, std::vector<std::byte> *held) {
    gl::Texture left;
    if (coarser < loaded.ktx.levels.size()) {
        const LevelsFrom all{texture.texture_, finest};
        if (held == nullptr) {
            left = allocate_texture(loaded.ktx, coarser, best_storage());
            copy_levels(loaded.ktx, all, {left, coarser});
        } else {
            read_levels(loaded.ktx, all, coarser, *held);
            texture.texture_ = {};
            left = allocate_texture(loaded.ktx, coarser, best_storage());
            write_levels(loaded.ktx, {left, coarser}, coarser, *held);
        }
        make_sampled(loaded.ktx, {left, coarser}, coarser, max_level);
    }
    texture.texture_ = std::move(left);
    texture.room_from_ = coarser;
    texture.finest_ = static_cast<int>(coarser);
}

} // namespace paradize
