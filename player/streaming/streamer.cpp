#include "streaming/streamer.hpp"

#include "assets/artifact_loader.hpp"
#include "assets/prefetcher.hpp"
#include "assets/upload_plan.hpp"
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

/// One artifact with its GPU objects. Scenes that share an artifact share the item.
struct StreamItem {
    assets::LoadedArtifact loaded; // kept until everything is uploaded
    StreamedTexture texture;
    StreamedMesh mesh;
    StreamedTile tile;
    assets::ArtifactKind kind = assets::ArtifactKind::sound;
    std::string sha256;
    std::size_t chunks_left = 0;
    std::uint64_t bytes = 0; // of all its chunks
};

struct Streamer::Impl {
    const assets::SceneFile &scene;
    std::vector<std::shared_ptr<StreamItem>> items; // one per artifact, same order
    std::vector<std::uint32_t> tiles;               // items that are terrain tiles
    std::vector<assets::UploadChunk> chunks;
    std::size_t next = 0;
    std::uint64_t resident = 0;
    std::uint64_t total = 0;
    std::uint64_t terrain = 0;
    std::unique_ptr<assets::Prefetcher> prefetcher;

    std::size_t reused = 0; // items taken over from the previous scene

    explicit Impl(const assets::SceneFile &file) : scene(file) {
        if (scene.terrain) {
            for (const std::string &name : scene.terrain->tiles) {
                tiles.push_back(
                    static_cast<std::uint32_t>(scene.find_artifact(name) - scene.artifacts.data()));
            }
        }
    }

    /// Creates the GPU objects of a loaded artifact.
    void add(std::uint32_t index, assets::LoadedArtifact loaded) {
        items[index] = std::make_shared<StreamItem>();
        StreamItem &item = *items[index];
        item.kind = scene.artifacts[index].kind;
        item.sha256 = scene.artifacts[index].sha256;
        item.loaded = std::move(loaded);
        if (item.loaded.tile) {
            item.tile = StreamedTile(item.loaded.glb, item.loaded.path);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh = StreamedMesh(item.loaded.glb);
        } else if (item.kind != assets::ArtifactKind::sound) {
            make_texture(item);
        }
        item.chunks_left = item.loaded.chunks.size();
        for (const assets::UploadChunk &chunk : item.loaded.chunks) {
            item.bytes += chunk.bytes.size();
        }
        chunks.insert(chunks.end(), item.loaded.chunks.begin(), item.loaded.chunks.end());
        item.loaded.chunks = {};
    }

    /// Returns a complete item for an artifact of another scene, or nullptr if there is none.
    std::shared_ptr<StreamItem> find_reusable(const assets::SceneFile &other,
                                              const assets::Artifact &artifact) const {
        const std::optional<std::uint32_t> tile = tile_of(other, artifact);
        const auto same = std::ranges::find_if(items, [&](const std::shared_ptr<StreamItem> &item) {
            return item->sha256 == artifact.sha256 && item->kind == artifact.kind && item->chunks_left == 0 &&
                   item->loaded.tile.has_value() == tile.has_value() &&
                   (!tile || fits_tile(item->loaded.glb, *other.terrain, *tile));
        });
        return same == items.end() ? nullptr : *same;
    }

    static void make_texture(StreamItem &item) {
        StreamedTexture &out = item.texture;
        const assets::Ktx2 &ktx = item.loaded.ktx;
        out.target_ = ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        out.width_px_ = static_cast<int>(ktx.levels[0].width_px);
        out.height_px_ = static_cast<int>(ktx.levels[0].height_px);
        out.levels_ = static_cast<int>(ktx.levels.size());
        out.has_green_ = assets::has_green(ktx.format);
        out.finest_ = out.levels_;
        out.texture_ = allocate_texture(ktx, item.loaded.path, best_storage());
        out.fallback_ = neutral_texture(ktx);
    }

    void upload_texture(const assets::UploadChunk &chunk) {
        StreamItem &item = *items[chunk.artifact];
        StreamedTexture &texture = item.texture;
        upload_rows(texture.texture_, item.loaded.ktx, chunk);
        if (chunk.last) {
            texture.finest_ = static_cast<int>(chunk.level);
            glTexParameteri(texture.target_, GL_TEXTURE_BASE_LEVEL, texture.finest_);
            if (chunk.inflated) {
                item.loaded.ktx.inflated_memory[chunk.level].release();
            }
        }
    }

    /// True if the next chunk can be uploaded. Throws Error if its file or level is broken.
    bool next_is_ready(NotReady not_ready) {
        if (!chunks[next].inflated && !chunks[next].released) {
            return true; // already in memory
        }
        if (!prefetcher->ready(next)) {
            if (not_ready == NotReady::skip) {
                return false;
            }
            prefetcher->advance(next);
            prefetcher->wait(next);
        }
        if (const std::string &error = prefetcher->error(next); !error.empty()) {
            const std::string &path = items[chunks[next].artifact]->loaded.path;
            throw Error(error.starts_with(path)
                            ? error // the error concerns the whole file
                            : path + ": level " + std::to_string(chunks[next].level) + ": " + error);
        }
        return true;
    }

    void upload_next() {
        const assets::UploadChunk &chunk = chunks[next++];
        StreamItem &item = *items[chunk.artifact];
        if (item.loaded.tile) {
            item.tile.upload(item.loaded.glb, chunk);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh.upload(chunk);
        } else {
            upload_texture(chunk);
        }
        resident += chunk.bytes.size();
        if (--item.chunks_left == 0) {
            item.loaded.file.release();
        }
    }
};

SceneLoad::SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
                     const Streamer *before, std::uint64_t max_waiting)
    : reused_(file.artifacts.size()) {
    std::vector<std::uint32_t> order = file.streaming; // then all artifacts that it does not name
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
            reused_[index] = before->impl_->find_reusable(file, file.artifacts[index]);
        }
        if (!reused_[index]) {
            wanted.push_back(index);
        }
    }
    loader_ = std::make_unique<assets::ArtifactLoader>(file, folder, std::move(wanted), max_waiting);
}

SceneLoad::SceneLoad(SceneLoad &&) noexcept = default;
SceneLoad::~SceneLoad() = default;

bool SceneLoad::ready() const {
    return loader_->ready();
}

Streamer::Streamer(const assets::SceneFile &file, const std::filesystem::path &folder, const Streamer *before)
    : Streamer(file, SceneLoad(file, folder, before)) {}

Streamer::Streamer(const assets::SceneFile &file, SceneLoad load) : impl_(std::make_unique<Impl>(file)) {
    std::vector<assets::LoadedArtifact> loaded = load.loader_->take();
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // Values for attributes that a mesh lacks: normal upwards, tangent along X, colour white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    impl_->items = std::move(load.reused_);
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->reused += item ? 1 : 0;
        impl_->resident += item ? item->bytes : 0;
    }
    for (std::size_t i = 0; i < loaded.size(); ++i) {
        impl_->add(load.loader_->wanted()[i], std::move(loaded[i]));
    }
    assets::order_chunks(impl_->chunks);
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->total += item->bytes;
        impl_->terrain += item->loaded.tile ? item->bytes : 0;
    }
    impl_->prefetcher =
        std::make_unique<assets::Prefetcher>(impl_->chunks, [impl = impl_.get()](std::uint32_t artifact) {
            return reload_fine(impl->items[artifact]->loaded);
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

bool Streamer::upload(std::size_t budget_bytes, NotReady not_ready) {
    std::size_t used = 0;
    while (!complete() && (used == 0 || used + impl_->chunks[impl_->next].bytes.size() <= budget_bytes) &&
           impl_->next_is_ready(not_ready)) {
        used += impl_->chunks[impl_->next].bytes.size();
        impl_->upload_next();
    }
    impl_->prefetcher->advance(impl_->next);
    return complete();
}

bool Streamer::complete() const {
    return impl_->next == impl_->chunks.size();
}

std::uint64_t Streamer::resident_bytes() const {
    return impl_->resident;
}

std::uint64_t Streamer::total_bytes() const {
    return impl_->total;
}

std::size_t Streamer::reused() const {
    return impl_->reused;
}

std::uint64_t Streamer::terrain_bytes() const {
    return impl_->terrain;
}

} // namespace paradize
