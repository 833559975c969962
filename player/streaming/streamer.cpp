#include "streaming/streamer.hpp"

#include "assets/loader.hpp"
#include "assets/opener.hpp"
#include "assets/stream_plan.hpp"
#include "error.hpp"
#include "gl/buffer.hpp"
#include "gl/texture.hpp"
#include "streaming/texture_format.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace paradize {

void StreamedTexture::bind(unsigned unit, unsigned sampler) const {
    gl::bind_texture(unit, target_, resident() ? texture_.name() : fallback_.name(), sampler);
}

/// One artifact on its way.
struct StreamItem {
    assets::OpenedArtifact opened; // its file until all of it is uploaded
    StreamedTexture texture;
    StreamedMesh mesh;
    StreamedTile tile;
    assets::ArtifactKind kind = assets::ArtifactKind::sound;
    std::string sha256;
    std::size_t pieces_left = 0;
    std::uint64_t bytes = 0; // of all its pieces
};

struct Streamer::Impl {
    const assets::SceneFile &scene;
    std::vector<std::shared_ptr<StreamItem>> items; // one per artifact, same order; of several scenes
    std::vector<std::uint32_t> tiles;               // the items that are the terrain's
    std::vector<assets::StreamPiece> pieces;
    std::size_t next = 0;
    std::uint64_t resident = 0;
    std::uint64_t total = 0;
    std::uint64_t terrain = 0;
    std::unique_ptr<assets::Loader> loader;

    std::size_t kept = 0; // items of the scene before

    explicit Impl(const assets::SceneFile &file) : scene(file) {
        if (scene.terrain) {
            for (const std::string &name : scene.terrain->tiles) {
                tiles.push_back(
                    static_cast<std::uint32_t>(scene.find_artifact(name) - scene.artifacts.data()));
            }
        }
    }

    /// Makes the device's objects for an artifact that was opened.
    void add(std::uint32_t index, assets::OpenedArtifact opened) {
        items[index] = std::make_shared<StreamItem>();
        StreamItem &item = *items[index];
        item.kind = scene.artifacts[index].kind;
        item.sha256 = scene.artifacts[index].sha256;
        item.opened = std::move(opened);
        if (item.opened.tile) {
            item.tile = StreamedTile(item.opened.glb, item.opened.path);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh = StreamedMesh(item.opened.glb);
        } else if (item.kind != assets::ArtifactKind::sound) {
            make_texture(item);
        }
        item.pieces_left = item.opened.pieces.size();
        for (const assets::StreamPiece &piece : item.opened.pieces) {
            item.bytes += piece.bytes.size();
        }
        pieces.insert(pieces.end(), item.opened.pieces.begin(), item.opened.pieces.end());
        item.opened.pieces = {};
    }

    /// What this scene has whole of an artifact of another; nullptr: nothing.
    std::shared_ptr<StreamItem> find(const assets::SceneFile &other, const assets::Artifact &artifact) const {
        const std::optional<std::uint32_t> tile = tile_of(other, artifact);
        const auto same = std::ranges::find_if(items, [&](const std::shared_ptr<StreamItem> &item) {
            return item->sha256 == artifact.sha256 && item->kind == artifact.kind && item->pieces_left == 0 &&
                   item->opened.tile.has_value() == tile.has_value() &&
                   (!tile || fits_tile(item->opened.glb, *other.terrain, *tile));
        });
        return same == items.end() ? nullptr : *same;
    }

    static void make_texture(StreamItem &item) {
        StreamedTexture &out = item.texture;
        const assets::Ktx2 &ktx = item.opened.ktx;
        out.target_ = ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        out.width_px_ = static_cast<int>(ktx.levels[0].width_px);
        out.height_px_ = static_cast<int>(ktx.levels[0].height_px);
        out.levels_ = static_cast<int>(ktx.levels.size());
        out.finest_ = out.levels_;
        out.texture_ = allocate_texture(ktx, item.opened.path, best_storage());
        out.fallback_ = neutral_texture(ktx);
    }

    void upload_texture(const assets::StreamPiece &piece) {
        StreamItem &item = *items[piece.artifact];
        StreamedTexture &texture = item.texture;
        upload_rows(texture.texture_, item.opened.ktx, piece);
        if (piece.last) {
            texture.finest_ = static_cast<int>(piece.level);
            glTexParameteri(texture.target_, GL_TEXTURE_BASE_LEVEL, texture.finest_);
            if (piece.inflated) {
                item.opened.ktx.rooms[piece.level].release();
            }
        }
    }

    /// Is the next piece there? Throws Error when it never will be.
    bool next_ready(Unready unready) {
        if (!pieces[next].inflated && !pieces[next].absent) {
            return true; // in memory
        }
        if (!loader->ready(next)) {
            if (unready == Unready::leave) {
                return false;
            }
            loader->advance(next);
            loader->wait(next);
        }
        if (const std::string &fault = loader->fault(next); !fault.empty()) {
            const std::string &path = items[pieces[next].artifact]->opened.path;
            throw Error(fault.starts_with(path)
                            ? fault // of the file as a whole
                            : path + ": level " + std::to_string(pieces[next].level) + ": " + fault);
        }
        return true;
    }

    void upload_one() {
        const assets::StreamPiece &piece = pieces[next++];
        StreamItem &item = *items[piece.artifact];
        if (item.opened.tile) {
            item.tile.upload(item.opened.glb, piece);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh.upload(piece);
        } else {
            upload_texture(piece);
        }
        resident += piece.bytes.size();
        if (--item.pieces_left == 0) {
            item.opened.file.release();
        }
    }
};

Opening::Opening(const assets::SceneFile &file, const std::filesystem::path &folder, const Streamer *before,
                 std::uint64_t most_held)
    : kept_(file.artifacts.size()) {
    std::vector<std::uint32_t> order = file.streaming; // and after it what it does not name
    for (std::uint32_t i = 0; i < file.artifacts.size(); ++i) {
        order.push_back(i);
    }
    std::vector<bool> seen(file.artifacts.size());
    std::vector<std::uint32_t> wanted;
    for (const std::uint32_t index : order) {
        if (seen[index]) {
            continue;
        }
        seen[index] = true;
        if (before != nullptr) {
            kept_[index] = before->impl_->find(file, file.artifacts[index]);
        }
        if (!kept_[index]) {
            wanted.push_back(index);
        }
    }
    opener_ = std::make_unique<assets::Opener>(file, folder, std::move(wanted), most_held);
}

Opening::Opening(Opening &&) noexcept = default;
Opening::~Opening() = default;

bool Opening::ready() const {
    return opener_->ready();
}

Streamer::Streamer(const assets::SceneFile &file, const std::filesystem::path &folder, const Streamer *before)
    : Streamer(file, Opening(file, folder, before)) {}

Streamer::Streamer(const assets::SceneFile &file, Opening opening) : impl_(std::make_unique<Impl>(file)) {
    std::vector<assets::OpenedArtifact> opened = opening.opener_->take();
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // What a mesh does not have: a normal upwards, a tangent along X, white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    impl_->items = std::move(opening.kept_);
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->kept += item ? 1 : 0;
        impl_->resident += item ? item->bytes : 0;
    }
    for (std::size_t i = 0; i < opened.size(); ++i) {
        impl_->add(opening.opener_->wanted()[i], std::move(opened[i]));
    }
    assets::order_pieces(impl_->pieces);
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->total += item->bytes;
        impl_->terrain += item->opened.tile ? item->bytes : 0;
    }
    impl_->loader =
        std::make_unique<assets::Loader>(impl_->pieces, [impl = impl_.get()](std::uint32_t artifact) {
            return fetch_fine(impl->items[artifact]->opened);
        });
}

Streamer::~Streamer() = default;

const StreamedTexture *Streamer::texture(std::string_view artifact) const {
    const assets::Artifact *found = impl_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &impl_->items[static_cast<std::size_t>(found - impl_->scene.artifacts.data())]->texture;
}

const StreamedMesh *Streamer::mesh(std::string_view artifact) const {
    const assets::Artifact *found = impl_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &impl_->items[static_cast<std::size_t>(found - impl_->scene.artifacts.data())]->mesh;
}

const StreamedTile &Streamer::tile(std::size_t index) const {
    return impl_->items[impl_->tiles[index]]->tile;
}

bool Streamer::upload(std::size_t budget_bytes, Unready unready) {
    std::size_t used = 0;
    while (!complete() && (used == 0 || used + impl_->pieces[impl_->next].bytes.size() <= budget_bytes) &&
           impl_->next_ready(unready)) {
        used += impl_->pieces[impl_->next].bytes.size();
        impl_->upload_one();
    }
    impl_->loader->advance(impl_->next);
    return complete();
}

bool Streamer::complete() const {
    return impl_->next == impl_->pieces.size();
}

std::uint64_t Streamer::resident_bytes() const {
    return impl_->resident;
}

std::uint64_t Streamer::total_bytes() const {
    return impl_->total;
}

std::size_t Streamer::kept() const {
    return impl_->kept;
}

std::uint64_t Streamer::terrain_bytes() const {
    return impl_->terrain;
}

} // namespace paradize
