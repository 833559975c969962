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
#include <iterator>
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
    std::optional<int> max_level; // coarsest mip to sample
    std::size_t pieces_left = 0;
    bool drawn = true; // something in its scene refers to it

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
            make_sampled(loaded.ktx, {finer, piece.first_level}, max_level);
            texture.texture_ = std::move(finer);
            texture.finest_ = static_cast<int>(piece.first_level);
        }
        --pieces_left;
    }

    void evict(std::uint32_t piece_index) {
        const assets::Piece &piece = loaded.plan.pieces[piece_index];
        if (loaded.tile) {
            tile.evict(piece_index);
        } else if (kind == assets::ArtifactKind::mesh) {
            mesh.evict(piece.first_level);
        } else {
            const std::uint32_t coarser = piece.first_level + piece.levels;
            gl::Texture left = allocate_texture(loaded.ktx, coarser, best_storage());
            copy_levels(loaded.ktx, {texture.texture_, piece.first_level}, {left, coarser});
            make_sampled(loaded.ktx, {left, coarser}, max_level);
            texture.texture_ = std::move(left);
            texture.finest_ = static_cast<int>(coarser);
        }
        ++pieces_left;
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
    std::vector<std::uint32_t> first_piece; // per artifact
    std::optional<Schedule> schedule;
    std::vector<Need> needs;          // one per piece
    std::vector<std::uint32_t> queue; // loads of the last plan that have not begun
    std::size_t pieces_left = 0;      // that are not resident
    StreamingCounts counts;
    std::size_t reused = 0; // items taken over from the previous scene
    std::vector<std::string> failures;

    /// The piece that is being uploaded.
    struct Current {
        std::uint32_t piece = 0; // of the scene
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
        item.max_level = scene.artifacts[index].max_level;
        item.loaded = std::move(loaded);
        item.drawn = scene.artifacts[index].drawn;
        const std::vector<assets::Piece> &plan = item.loaded.plan.pieces;
        if (!item.drawn) {
            return;
        }
        if (item.loaded.tile) {
            item.tile = StreamedTile(item.loaded.glb, plan, item.loaded.path);
        } else if (item.kind == assets::ArtifactKind::mesh) {
            item.mesh = StreamedMesh(item.loaded.glb, item.loaded.materials);
        } else if (item.kind != assets::ArtifactKind::sound) {
            make_texture(item);
        }
        item.pieces_left = plan.size();
    }

    /// Adds the pieces of an artifact to those of the scene.
    void add_pieces(std::uint32_t index) {
        first_piece[index] = static_cast<std::uint32_t>(pieces.size());
        const StreamItem &item = *items[index];
        for (std::uint32_t i = 0; i < item.loaded.plan.pieces.size(); ++i) {
            pieces.push_back({index, i});
            counts.total_bytes += item.loaded.plan.pieces[i].bytes;
            counts.terrain_bytes += item.loaded.tile ? item.loaded.plan.pieces[i].bytes : 0;
        }
    }

    /// Creates the schedule of all pieces. A piece's parent is the next coarser one. Those of terrain have
    /// none: a cut uses what is resident, and a patch is never needed more than those that it replaces.
    void make_schedule(std::uint64_t vram_bytes) {
        std::vector<ScheduledPiece> scheduled(pieces.size());
        for (std::uint32_t i = 0; i < pieces.size(); ++i) {
            const StreamItem &item = item_of(i);
            scheduled[i].bytes = plan_of(i).bytes;
            scheduled[i].coarse = plan_of(i).coarse;
            if (pieces[i].index != 0 && !item.loaded.tile) {
                scheduled[i].parents = {i - 1};
            }
            if (item.kind != assets::ArtifactKind::mesh) { // the coarser mips are copied
                for (std::uint32_t coarser = i - pieces[i].index; coarser < i; ++coarser) {
                    scheduled[i].working_bytes += plan_of(coarser).bytes;
                }
            }
        }
        schedule.emplace(std::move(scheduled), vram_bytes);
        for (std::uint32_t i = 0; i < pieces.size(); ++i) {
            if (item_of(i).pieces_left == 0) { // reused
                schedule->set_loading(i);
                schedule->set_resident(i);
                counts.resident_bytes += plan_of(i).bytes;
            } else {
                ++pieces_left;
            }
        }
        needs.resize(pieces.size());
        queue.reserve(pieces.size());
        ahead.reserve(pieces.size());
    }

    /// Returns a complete item for an artifact of another scene, or nullptr if there is none.
    std::shared_ptr<StreamItem> find_reusable(const assets::SceneFile &other,
                                              const assets::Artifact &artifact) const {
        const std::optional<std::uint32_t> tile = tile_of(other, artifact);
        const auto same = std::ranges::find_if(items, [&](const std::shared_ptr<StreamItem> &item) {
            return item->sha256 == artifact.sha256 && item->kind == artifact.kind && item->pieces_left == 0 &&
                   item->drawn == artifact.drawn && item->loaded.tile.has_value() == tile.has_value() &&
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

    /// Plans, evicts, and lets the loader stage the next pieces.
    void plan() {
        schedule->plan(needs, ahead_bytes);
        for (const std::uint32_t piece : schedule->evictions()) {
            item_of(piece).evict(pieces[piece].index);
            schedule->set_absent(piece);
            counts.resident_bytes -= plan_of(piece).bytes;
            ++counts.evictions;
            ++pieces_left;
        }
        queue.assign(schedule->loads().begin(), schedule->loads().end());
        ahead.clear();
        std::ranges::copy_if(queue, std::back_inserter(ahead),
                             [&](std::uint32_t piece) { return needs_staging(piece); });
        loader->order(ahead);
        counts.needed_bytes = schedule->needed_bytes();
        counts.worst_error = schedule->worst_error();
    }

    /// Returns the place in the queue of the piece to upload next, or nothing if none is ready. Its parents
    /// come first.
    std::optional<std::size_t> next_piece(NotReady not_ready) const {
        for (std::size_t i = 0; i < queue.size(); ++i) {
            const bool is_ready =
                not_ready == NotReady::wait || !needs_staging(queue[i]) || loader->ready(queue[i]);
            if (is_ready && schedule->can_load(queue[i])) {
                return i;
            }
        }
        return std::nullopt;
    }

    /// Drops all pieces of an artifact whose file cannot be read any more.
    void give_up(std::uint32_t artifact, std::string error) {
        failures.push_back(std::move(error));
        for (std::uint32_t i = 0; i < items[artifact]->loaded.plan.pieces.size(); ++i) {
            pieces_left -= schedule->give_up(first_piece[artifact] + i) ? 1 : 0;
        }
        plan();
    }

    /// Begins the piece at this place of the queue.
    void begin(std::size_t place) {
        Current next;
        next.piece = queue[place];
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
        queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(place));
        schedule->set_loading(next.piece);
        counts.peak_bytes =
            std::max(counts.peak_bytes, schedule->used_bytes() + schedule->working_bytes(next.piece));
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
        counts.resident_bytes += chunk.bytes.size();
        if (++current->chunks_done == piece.chunks) {
            item.finish(pieces[current->piece].index);
            schedule->set_resident(current->piece);
            --pieces_left;
            if (item.pieces_left == 0 && schedule->budget_bytes() == 0) {
                item.loaded.file.release(); // nothing is evicted
            }
            current.reset();
        }
    }
};

SceneLoad::SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
                     const Streamer *before, const MemoryLimits &limits)
    : reused_(file.artifacts.size()), limits_(limits) {
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
        if (before != nullptr && limits.vram_bytes == 0) { // else one scene would evict what both draw
            reused_[index] = before->impl_->find_reusable(file, file.artifacts[index]);
        }
        if (!reused_[index]) {
            wanted.push_back(index);
        }
    }
    loader_ = std::make_unique<assets::ArtifactLoader>(file, folder, std::move(wanted), limits.ram_bytes);
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
    impl_->first_piece.resize(impl_->items.size());
    std::vector<std::uint32_t> order = load.loader_->wanted();
    for (std::uint32_t i = 0; i < impl_->items.size(); ++i) {
        if (impl_->items[i]) {
            ++impl_->reused;
            order.push_back(i);
        }
    }
    for (std::size_t i = 0; i < loaded.size(); ++i) {
        impl_->add(load.loader_->wanted()[i], std::move(loaded[i]));
    }
    for (const std::uint32_t index : order) {
        impl_->add_pieces(index);
    }
    impl_->make_schedule(load.limits_.vram_bytes);
    impl_->loader = std::make_unique<assets::PieceLoader>(
        impl_->pieces.size(), [impl = impl_.get()](std::uint32_t piece, assets::Inflater &inflater) {
            return assets::stage(impl->item_of(piece).loaded, impl->plan_of(piece), inflater);
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

std::size_t Streamer::piece_count() const {
    return impl_->pieces.size();
}

const assets::Piece &Streamer::piece(std::uint32_t index) const {
    return impl_->plan_of(index);
}

std::pair<std::uint32_t, std::uint32_t> Streamer::pieces_of(std::string_view artifact) const {
    const assets::Artifact *found = impl_->scene.find_artifact(artifact);
    if (found == nullptr) {
        return {0, 0};
    }
    const auto index = static_cast<std::size_t>(found - impl_->scene.artifacts.data());
    return {impl_->first_piece[index],
            static_cast<std::uint32_t>(impl_->items[index]->loaded.plan.pieces.size())};
}

void Streamer::set_needs(std::span<const Need> needs) {
    std::ranges::copy(needs, impl_->needs.begin());
}

bool Streamer::upload(const UploadBudget &budget) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    if (settled()) {
        return true;
    }
    impl_->plan();
    std::size_t used = 0;
    while (true) {
        if (!impl_->current && impl_->queue.empty()) {
            impl_->plan();
        }
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
    return !impl_->current && impl_->queue.empty();
}

bool Streamer::complete() const {
    return impl_->pieces_left == 0;
}

bool Streamer::settled() const {
    return complete() && impl_->schedule->budget_bytes() == 0;
}

const StreamingCounts &Streamer::counts() const {
    return impl_->counts;
}

std::span<const std::string> Streamer::failures() const {
    return impl_->failures;
}

std::size_t Streamer::reused() const {
    return impl_->reused;
}

} // namespace paradize
