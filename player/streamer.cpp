#include "streamer.hpp"

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"
#include "assets/loader.hpp"
#include "assets/mapped_file.hpp"
#include "assets/stream_plan.hpp"
#include "error.hpp"
#include "gl/buffer.hpp"
#include "gl/texture.hpp"
#include "texture_format.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace paradize {

void StreamedTexture::bind(unsigned unit, unsigned sampler) const {
    gl::bind_texture(unit, target_, resident() ? texture_.name() : fallback_.name(), sampler);
}

/// One artifact on its way.
struct StreamItem {
    assets::MappedFile file;
    assets::Ktx2 ktx;
    assets::Glb glb;
    std::string path; // empty: not opened yet, or a sound
    StreamedTexture texture;
    StreamedMesh mesh;
    StreamedTile tile;
    bool is_tile = false;
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

    explicit Impl(const assets::SceneFile &file) : scene(file), items(file.artifacts.size()) {
        if (scene.terrain) {
            for (const std::string &name : scene.terrain->tiles) {
                tiles.push_back(
                    static_cast<std::uint32_t>(scene.find_artifact(name) - scene.artifacts.data()));
            }
        }
    }

    void open(std::uint32_t index, const std::filesystem::path &folder) {
        const assets::Artifact &artifact = scene.artifacts[index];
        items[index] = std::make_shared<StreamItem>();
        StreamItem &item = *items[index];
        item.kind = artifact.kind;
        item.sha256 = artifact.sha256;
        if (artifact.kind == assets::ArtifactKind::sound) {
            return;
        }
        item.path = (folder / artifact.file).string();
        item.file = assets::MappedFile(item.path);
        const std::span<const std::byte> bytes = item.file.bytes();
        if (artifact.bytes != 0 && artifact.bytes != bytes.size()) {
            throw Error(item.path + ": has " + std::to_string(bytes.size()) + " bytes, scene.json says " +
                        std::to_string(artifact.bytes) + "; bake the scene again");
        }
        const std::size_t before = pieces.size();
        const auto tile = std::ranges::find(tiles, index);
        if (tile != tiles.end()) {
            open_tile(item, index, static_cast<std::uint32_t>(tile - tiles.begin()));
        } else if (artifact.kind == assets::ArtifactKind::mesh) {
            item.glb = assets::read_glb(bytes, item.path);
            plan_mesh(item.glb, index, pieces);
            item.mesh = StreamedMesh(item.glb);
        } else {
            item.ktx = assets::read_ktx2(bytes, item.path);
            const bool cube = artifact.kind == assets::ArtifactKind::cubemap;
            if (cube != (item.ktx.faces == 6)) {
                throw Error(item.path + ": has " + std::to_string(item.ktx.faces) + " faces, which is no " +
                            (cube ? "cube map" : "flat texture"));
            }
            plan_texture(item.ktx, index, pieces);
            make_texture(item);
        }
        item.pieces_left = pieces.size() - before;
        for (std::size_t i = before; i < pieces.size(); ++i) {
            item.bytes += pieces[i].bytes.size();
        }
    }

    /// Takes what the scene before has of this artifact, when it is the same and all there.
    bool keep(std::uint32_t index, const Impl &before) {
        const assets::Artifact &artifact = scene.artifacts[index];
        const auto same = std::ranges::find_if(before.items, [&](const std::shared_ptr<StreamItem> &item) {
            return !artifact.sha256.empty() && item->sha256 == artifact.sha256 &&
                   item->kind == artifact.kind && item->pieces_left == 0;
        });
        const auto tile = std::ranges::find(tiles, index);
        if (same == before.items.end() || (*same)->is_tile != (tile != tiles.end()) ||
            ((*same)->is_tile && !fits(**same, rows_of(static_cast<std::uint32_t>(tile - tiles.begin()))))) {
            return false;
        }
        items[index] = *same;
        resident += (*same)->bytes;
        ++kept;
        return true;
    }

    struct Rows {
        std::size_t first = 0, count = 0;
    };

    Rows rows_of(std::uint32_t tile) const {
        const std::vector<std::uint32_t> &column = scene.terrain->patches.tile;
        const auto [first, end] = std::ranges::equal_range(column, tile);
        return {static_cast<std::size_t>(first - column.begin()), static_cast<std::size_t>(end - first)};
    }

    /// The first patch of these rows that is not the tile's node in its place; their count: all are.
    static std::size_t first_other(const StreamItem &item, const Rows &rows) {
        std::size_t i = 0;
        while (i < rows.count && item.glb.levels[i].name == "patch" + std::to_string(rows.first + i)) {
            ++i;
        }
        return i;
    }

    static bool fits(const StreamItem &item, const Rows &rows) {
        return item.glb.levels.size() == rows.count && first_other(item, rows) == rows.count;
    }

    void open_tile(StreamItem &item, std::uint32_t index, std::uint32_t tile) {
        const assets::TerrainPatches &patches = scene.terrain->patches;
        const auto [row, count] = rows_of(tile);
        if (count == 0) {
            throw Error(item.path + ": scene.json has no patch in this tile of the terrain");
        }
        item.glb =
            assets::read_glb_nodes(item.file.bytes(), item.path, std::span(patches.node).subspan(row, count));
        if (const std::size_t i = first_other(item, {row, count}); i < count) {
            throw Error(item.path + ": node " + item.glb.levels[i].name +
                        ": scene.json says that it is patch" + std::to_string(row + i) +
                        "; bake the scene again");
        }
        const auto roots = static_cast<std::size_t>(
            std::count(patches.made_by.begin() + static_cast<std::ptrdiff_t>(row),
                       patches.made_by.begin() + static_cast<std::ptrdiff_t>(row + count), std::int32_t{-1}));
        plan_patches(item.glb, roots, index, pieces);
        item.tile = StreamedTile(item.glb, item.path);
        item.is_tile = true;
    }

    static void make_texture(StreamItem &item) {
        StreamedTexture &out = item.texture;
        out.target_ = item.ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        out.width_px_ = static_cast<int>(item.ktx.levels[0].width_px);
        out.height_px_ = static_cast<int>(item.ktx.levels[0].height_px);
        out.levels_ = static_cast<int>(item.ktx.levels.size());
        out.finest_ = out.levels_;
        out.texture_ = allocate_texture(item.ktx, item.path, best_storage());
        out.fallback_ = neutral_texture(item.ktx);
    }

    void upload_texture(const assets::StreamPiece &piece) {
        StreamItem &item = *items[piece.artifact];
        StreamedTexture &texture = item.texture;
        upload_rows(texture.texture_, item.ktx, piece);
        if (piece.last) {
            texture.finest_ = static_cast<int>(piece.level);
            glTexParameteri(texture.target_, GL_TEXTURE_BASE_LEVEL, texture.finest_);
            if (piece.inflated) {
                item.ktx.rooms[piece.level].release();
            }
        }
    }

    /// Is the next piece there? Throws Error when it never will be.
    bool next_ready(Unready unready) {
        if (!pieces[next].inflated) {
            return true; // mapped: at worst the disk is waited for
        }
        if (!loader->ready(next)) {
            if (unready == Unready::leave) {
                return false;
            }
            loader->advance(next);
            loader->wait(next);
        }
        if (const std::string &fault = loader->fault(next); !fault.empty()) {
            throw Error(items[pieces[next].artifact]->path + ": level " + std::to_string(pieces[next].level) +
                        ": " + fault);
        }
        return true;
    }

    void upload_one() {
        const assets::StreamPiece &piece = pieces[next++];
        StreamItem &item = *items[piece.artifact];
        if (item.is_tile) {
            item.tile.upload(item.glb, piece, item.path);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh.upload(item.glb, piece, item.path);
        } else {
            upload_texture(piece);
        }
        resident += piece.bytes.size();
        if (--item.pieces_left == 0) {
            item.file.release_pages();
        }
    }
};

Streamer::Streamer(const assets::SceneFile &file, const std::filesystem::path &folder, const Streamer *before)
    : impl_(std::make_unique<Impl>(file)) {
    std::vector<std::uint32_t> order = file.streaming; // and after it what it does not name
    for (std::uint32_t i = 0; i < file.artifacts.size(); ++i) {
        order.push_back(i);
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // What a mesh does not have: a normal upwards, a tangent along X, white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    for (const std::uint32_t index : order) {
        if (!impl_->items[index] && !(before != nullptr && impl_->keep(index, *before->impl_))) {
            impl_->open(index, folder);
        }
    }
    assets::order_pieces(impl_->pieces);
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->total += item->bytes;
        impl_->terrain += item->is_tile ? item->bytes : 0;
    }
    impl_->loader = std::make_unique<assets::Loader>(impl_->pieces);
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
