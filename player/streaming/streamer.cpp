#include "streaming/streamer.hpp"

#include "assets/artifact_loader.hpp"
#include "assets/piece_loader.hpp"
#include "assets/upload_plan.hpp"
#include "error.hpp"
#include "gl/buffer.hpp"
#include "gl/texture.hpp"
#include "streaming/texture_format.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace paradize {

void StreamedTexture::bind(unsigned unit, unsigned sampler) const {
    gl::bind_texture(unit, target_, resident() ? texture_.name() : fallback_.name(), sampler);
}

/// One artifact with its GPU objects. Scenes that share an artifact share the item.
struct StreamItem {
    assets::LoadedArtifact loaded; // its file is released when everything is uploaded
    StreamedTexture texture;
    gl::Texture finer; // replaces the texture once its finest level is uploaded
    StreamedMesh mesh;
    StreamedTile tile;
    assets::ArtifactKind kind = assets::ArtifactKind::sound;
    std::string sha256;
    std::size_t pieces_left = 0;
    std::uint64_t bytes = 0; // of all its pieces
    bool failed = false;     // its file cannot be read any more

    /// Creates the GPU objects of a piece.
    void begin(std::uint32_t piece_index) {
        const assets::Piece &piece = loaded.plan.pieces[piece_index];
        if (loaded.tile) {
            tile.begin(loaded.glb, piece_index);
        } else if (kind == assets::ArtifactKind::mesh) {
            mesh.begin(loaded.glb, piece.first_level);
        } else {
            finer = allocate_texture(loaded.ktx, piece.first_level, best_storage());
            if (texture.resident()) {
                copy_levels(loaded.ktx, {texture.texture_, static_cast<std::uint32_t>(texture.finest_)},
                            {finer, piece.first_level});
            }
        }
    }

    void upload(const assets::Piece &piece, const assets::UploadChunk &chunk, const std::byte *data) {
        if (loaded.tile) {
            tile.upload(loaded.glb, chunk, data);
        } else if (kind == assets::ArtifactKind::mesh) {
            mesh.upload(chunk, data);
        } else {
            upload_rows({finer, piece.first_level}, loaded.ktx, chunk, data);
        }
    }

    /// Makes an uploaded piece visible.
    void finish(std::uint32_t piece_index) {
        const assets::Piece &piece = loaded.plan.pieces[piece_index];
        if (loaded.tile) {
            tile.finish(piece_index);
        } else if (kind == assets::ArtifactKind::mesh) {
            mesh.finish(piece.first_level);
        } else {
            make_sampled(loaded.ktx, finer);
            texture.texture_ = std::move(finer);
            texture.finest_ = static_cast<int>(piece.first_level);
        }
        if (--pieces_left == 0) {
            loaded.file.release();
        }
    }
};

namespace {

/// A piece of the scene.
struct ScenePiece {
    std::uint32_t artifact = 0; // index into SceneFile::artifacts
    std::uint32_t index = 0;    // into the artifact's plan
};

constexpr std::uint64_t ahead_bytes = std::uint64_t{16} << 20U; // staged ahead of the upload, or one piece

} // namespace

struct Streamer::Impl {
    const assets::SceneFile &scene;
    std::vector<std::shared_ptr<StreamItem>> items; // one per artifact, same order
    std::vector<std::uint32_t> tiles;               // items that are terrain tiles
    std::vector<ScenePiece> pieces;
    std::vector<std::uint32_t> order; // pieces that are not resident yet, the first one first
    std::uint64_t resident = 0;
    std::uint64_t total = 0;
    std::uint64_t terrain = 0;
    std::size_t reused = 0; // items taken over from the previous scene
    std::vector<std::string> failures;

    /// The piece that is being uploaded.
    struct Current {
        std::uint32_t piece = 0;
        std::uint32_t chunks_done = 0;
        std::uint64_t bytes_done = 0;
        std::unique_ptr<std::byte[]> staged; // nullptr: the chunks are in memory
    };
    std::optional<Current> current;
    std::vector<std::uint32_t> ahead;            // pieces for the loader
    std::unique_ptr<assets::PieceLoader> loader; // the last member: its thread uses the others

    explicit Impl(const assets::SceneFile &file) : scene(file) {
        if (scene.terrain) {
            for (const std::string &name : scene.terrain->tiles) {
                tiles.push_back(
                    static_cast<std::uint32_t>(scene.find_artifact(name) - scene.artifacts.data()));
            }
        }
    }

    StreamItem &item_of(std::uint32_t piece) const { return *items[pieces[piece].artifact]; }
    const assets::Piece &plan_of(std::uint32_t piece) const {
        return item_of(piece).loaded.plan.pieces[pieces[piece].index];
    }
    bool needs_staging(std::uint32_t piece) const {
        return assets::needs_staging(item_of(piece).loaded, plan_of(piece));
    }

    void add(std::uint32_t index, assets::LoadedArtifact loaded) {
        items[index] = std::make_shared<StreamItem>();
        StreamItem &item = *items[index];
        item.kind = scene.artifacts[index].kind;
        item.sha256 = scene.artifacts[index].sha256;
        item.loaded = std::move(loaded);
        const std::vector<assets::Piece> &plan = item.loaded.plan.pieces;
        if (item.loaded.tile) {
            item.tile = StreamedTile(item.loaded.glb, plan, item.loaded.path);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh = StreamedMesh(item.loaded.glb);
        } else if (item.kind != assets::ArtifactKind::sound) {
            make_texture(item);
        }
        item.pieces_left = plan.size();
        for (std::uint32_t i = 0; i < plan.size(); ++i) {
            item.bytes += plan[i].bytes;
            order.push_back(static_cast<std::uint32_t>(pieces.size()));
            pieces.push_back({index, i});
        }
    }

    /// Returns a complete item for an artifact of another scene, or nullptr if there is none.
    std::shared_ptr<StreamItem> find_reusable(const assets::SceneFile &other,
                                              const assets::Artifact &artifact) const {
        const std::optional<std::uint32_t> tile = tile_of(other, artifact);
        const auto same = std::ranges::find_if(items, [&](const std::shared_ptr<StreamItem> &item) {
            return item->sha256 == artifact.sha256 && item->kind == artifact.kind && item->pieces_left == 0 &&
                   item->loaded.tile.has_value() == tile.has_value() &&
                   (!tile || fits_tile(item->loaded.glb, *other.terrain, *tile));
        });
        return same == items.end() ? nullptr : *same;
    }

    static void make_texture(StreamItem &item) {
        StreamedTexture &out = item.texture;
        const assets::Ktx2 &ktx = item.loaded.ktx;
        check_support(ktx, item.loaded.path);
        out.target_ = ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        out.width_px_ = static_cast<int>(ktx.levels[0].width_px);
        out.height_px_ = static_cast<int>(ktx.levels[0].height_px);
        out.levels_ = static_cast<int>(ktx.levels.size());
        out.has_green_ = assets::has_green(ktx.format);
        out.finest_ = out.levels_;
        out.fallback_ = neutral_texture(ktx);
    }

    /// Lets the loader stage the next pieces.
    void order_ahead() {
        ahead.clear();
        std::uint64_t bytes = 0;
        for (std::size_t i = 0; i < order.size() && (bytes == 0 || bytes < ahead_bytes); ++i) {
            if (needs_staging(order[i])) {
                ahead.push_back(order[i]);
                bytes += plan_of(order[i]).bytes;
            }
        }
        loader->order(ahead);
    }

    /// Returns the place in `order` of the piece to upload next, or nothing if none is ready.
    std::optional<std::size_t> next_piece(NotReady not_ready) const {
        if (order.empty()) {
            return std::nullopt;
        }
        if (not_ready == NotReady::wait || !needs_staging(order.front())) {
            return 0;
        }
        for (std::size_t i = 0; i < order.size() && i <= ahead.size(); ++i) {
            if (!needs_staging(order[i]) || loader->ready(order[i])) {
                return i;
            }
        }
        return std::nullopt;
    }

    /// Drops all pieces of an artifact whose file cannot be read any more.
    void give_up(std::uint32_t artifact, std::string error) {
        items[artifact]->failed = true;
        failures.push_back(std::move(error));
        std::erase_if(order, [&](std::uint32_t piece) { return pieces[piece].artifact == artifact; });
        order_ahead();
    }

    /// Begins the piece at this place of `order`.
    void begin(std::size_t place) {
        Current next;
        next.piece = order[place];
        if (needs_staging(next.piece)) {
            assets::StagedPiece staged = loader->take(next.piece);
            if (staged.file_failed) {
                give_up(pieces[next.piece].artifact, std::move(staged.error));
                return;
            }
            if (!staged.error.empty()) {
                throw Error(staged.error);
            }
            next.staged = std::move(staged.bytes);
        }
        order.erase(order.begin() + static_cast<std::ptrdiff_t>(place));
        order_ahead();
        item_of(next.piece).begin(pieces[next.piece].index);
        current = std::move(next);
    }

    const assets::UploadChunk &next_chunk() const {
        return item_of(current->piece).loaded.plan.chunks_of(plan_of(current->piece))[current->chunks_done];
    }

    void upload_next() {
        StreamItem &item = item_of(current->piece);
        const assets::Piece &piece = plan_of(current->piece);
        const assets::UploadChunk &chunk = next_chunk();
        item.upload(piece, chunk,
                    current->staged ? current->staged.get() + current->bytes_done : chunk.bytes.data());
        current->bytes_done += chunk.bytes.size();
        resident += chunk.bytes.size();
        if (++current->chunks_done == piece.chunks) {
            item.finish(pieces[current->piece].index);
            current.reset();
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
    std::ranges::stable_partition(impl_->order,
                                  [&](std::uint32_t piece) { return impl_->plan_of(piece).coarse; });
    for (const std::shared_ptr<StreamItem> &item : impl_->items) {
        impl_->total += item->bytes;
        impl_->terrain += item->loaded.tile ? item->bytes : 0;
    }
    impl_->ahead.reserve(impl_->pieces.size());
    impl_->loader = std::make_unique<assets::PieceLoader>(
        impl_->pieces.size(), [impl = impl_.get()](std::uint32_t piece, assets::Inflater &inflater) {
            return assets::stage(impl->item_of(piece).loaded, impl->plan_of(piece), inflater);
        });
    impl_->order_ahead();
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

bool Streamer::upload(const UploadBudget &budget) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    std::size_t used = 0;
    while (true) {
        if (!impl_->current) {
            const std::optional<std::size_t> place = impl_->next_piece(budget.not_ready);
            if (!place) {
                break;
            }
            impl_->begin(*place);
            continue;
        }
        const std::size_t bytes = impl_->next_chunk().bytes.size();
        const bool late = std::chrono::duration<double, std::milli>(Clock::now() - start).count() > budget.ms;
        if (used != 0 && (used + bytes > budget.bytes || late)) {
            break;
        }
        used += bytes;
        impl_->upload_next();
    }
    return complete();
}

bool Streamer::complete() const {
    return impl_->order.empty() && !impl_->current;
}

std::span<const std::string> Streamer::failures() const {
    return impl_->failures;
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
