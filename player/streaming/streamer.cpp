#include "streaming/streamer.hpp"

#include "assets/artifact_loader.hpp"
#include "assets/file_checker.hpp"
#include "assets/piece_loader.hpp"
#include "assets/upload_plan.hpp"
#include "error.hpp"
#include "gl/buffer.hpp"
#include "streaming/stream_item.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <optional>
#include <utility>

namespace paradize {

namespace {

/// A piece of the scene.
struct ScenePiece {
    std::uint32_t artifact = 0; // index into SceneFile::artifacts
    std::uint32_t index = 0;    // into the artifact's plan
};

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t largest_page_bytes = std::uint64_t{16} << 20U; // of terrain patches
constexpr std::uint64_t smallest_page_bytes = std::uint64_t{1} << 20U;

/// How terrain patches share buffers: see PatchPool.
struct PatchPages {
    std::uint64_t page_bytes = 0; // 0: each block has buffers of its own
    std::uint64_t slack_bytes = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t reserve_bytes = 0; // of the limit, for what is unused of pages
};

PatchPages patch_pages(const assets::SceneFile &scene, std::uint64_t vram_bytes) {
    std::uint64_t terrain_bytes = 0;
    if (scene.terrain) {
        for (const std::string &tile : scene.terrain->tiles) {
            terrain_bytes += scene.find_artifact(tile)->bytes;
        }
    }
    PatchPages out;
    out.page_bytes = std::min(largest_page_bytes, terrain_bytes);
    if (vram_bytes != 0) {
        const std::uint64_t shared = std::min(out.page_bytes, vram_bytes / 64);
        out.page_bytes = shared < smallest_page_bytes ? 0 : shared;
        out.reserve_bytes = out.page_bytes == 0 ? 0 : std::min(terrain_bytes, vram_bytes / 16);
        out.slack_bytes = out.reserve_bytes;
    }
    return out;
}

constexpr float urgent_error = 2.0F;                            // as a multiple of the accepted one
constexpr std::uint64_t ahead_bytes = std::uint64_t{16} << 20U; // staged ahead of the upload, or one piece

} // namespace

struct Streamer::Impl {
    const assets::SceneFile &scene;
    std::shared_ptr<PatchPool> patches;
    std::vector<std::shared_ptr<StreamItem>> items; // one per artifact, same order
    std::vector<std::uint32_t> tiles;               // items that are terrain tiles
    std::vector<ScenePiece> pieces;
    std::vector<std::uint32_t> first_piece; // per artifact
    std::optional<Schedule> schedule;
    std::vector<Need> needs;          // one per piece
    std::vector<std::uint32_t> queue; // loads of the last plan that have not begun
    std::size_t pieces_left = 0;      // that are not resident
    StreamingCounts counts;
    std::size_t reused = 0;      // items taken over from the previous scene
    std::vector<std::byte> held; // mips while their texture is made anew
    std::vector<std::string> failures;

    /// The piece that is being uploaded.
    struct Current {
        std::uint32_t piece = 0; // of the scene
        std::uint32_t chunks_done = 0;
        std::uint64_t bytes_done = 0;
        std::unique_ptr<std::byte[]> staged; // nullptr: the chunks are in memory
    };
    std::optional<Current> current, paused;   // paused: gives way to pieces that are needed now
    std::vector<std::uint32_t> ahead;         // pieces for the loader
    std::vector<std::uint32_t> files_ahead;   // artifacts for the checker
    bool has_uploaded = false;                // upload() was called
    std::vector<bool> begun_files;            // per artifact: a piece of it was begun
    std::uint64_t begun_bytes = 0;            // of the files that the last call began
    std::vector<bool> ordered;                // per piece: planned at the end of the last call
    mutable std::vector<bool> known_checked;  // per artifact: what the checker said last
    std::atomic<std::uint64_t> waiting_bytes; // of checked files that stay in memory until they are uploaded
    std::uint64_t max_waiting_bytes = 0;
    std::atomic<std::uint64_t> read_bytes, read_ns; // by the threads, and how long that took them
    // The last members: their threads use the others.
    std::unique_ptr<assets::FileChecker> checker;
    std::unique_ptr<assets::PieceLoader> loader;

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
    bool is_checked(std::uint32_t artifact) const {
        if (!known_checked[artifact]) {
            known_checked[artifact] = checker->checked(artifact);
        }
        return known_checked[artifact];
    }
    bool is_checked_of(std::uint32_t piece) const { return is_checked(pieces[piece].artifact); }
    /// The piece's file must be checked.
    bool needs_staging(std::uint32_t piece) const {
        return assets::needs_staging(item_of(piece).loaded, plan_of(piece));
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

    /// Checks an artifact's file. Runs on the checker's threads, once for each file. Beyond
    /// `max_waiting_bytes` its memory is freed.
    void check(std::uint32_t artifact, const std::stop_token &stop) {
        assets::LoadedArtifact &loaded = items[artifact]->loaded;
        const Clock::time_point start = Clock::now();
        assets::check_artifact(scene.artifacts[artifact], loaded, stop);
        count_read(scene.artifacts[artifact].bytes, start);
        const std::uint64_t bytes = loaded.file.bytes().size();
        if (waiting_bytes.fetch_add(bytes) + bytes > max_waiting_bytes) {
            waiting_bytes.fetch_sub(bytes);
            free_memory(loaded);
        }
    }

    void count_read(std::uint64_t bytes, Clock::time_point since) {
        read_bytes += bytes;
        read_ns += static_cast<std::uint64_t>(
            std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - since).count());
    }

    /// Frees the memory of a file that is not needed any more.
    void release(assets::FileBytes &file) {
        if (file.in_memory()) {
            waiting_bytes.fetch_sub(file.bytes().size());
        }
        file.release();
    }

    /// Creates the schedule of all pieces. A piece's parent is the next coarser one. Those of terrain have
    /// none: a cut uses what is resident, and a patch is never needed more than those that it replaces.
    void make_schedule(const MemoryLimits &limits) {
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
        if (limits.vram_bytes != 0 && !scheduled.empty()) {
            held.reserve(std::ranges::max(scheduled, {}, &ScheduledPiece::working_bytes).working_bytes);
        }
        const std::uint64_t reserve_bytes = patch_pages(scene, limits.vram_bytes).reserve_bytes;
        schedule.emplace(std::move(scheduled), limits.vram_bytes - reserve_bytes, limits.order);
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
        ordered.resize(pieces.size());
        queue.reserve(pieces.size());
        ahead.reserve(pieces.size());
        files_ahead.reserve(items.size());
    }

    /// Returns a complete item for an artifact of another scene, or nullptr if there is none.
    std::shared_ptr<StreamItem> find_reusable(const assets::SceneFile &other,
                                              const assets::Artifact &artifact) const {
        const std::optional<std::uint32_t> tile = tile_of(other, artifact);
        for (std::uint32_t i = 0; i < items.size(); ++i) {
            const StreamItem &item = *items[i];
            if (item.loaded.sha256 == artifact.sha256 && item.kind == artifact.kind &&
                item.pieces_left == 0 && is_checked(i) && item.drawn == artifact.drawn &&
                item.loaded.tile.has_value() == tile.has_value() &&
                (!tile || fits_tile(item.loaded.glb, *other.terrain, *tile))) {
                return items[i];
            }
        }
        return nullptr;
    }

    /// Plans, evicts, and lets the loader stage the next pieces.
    void plan() {
        schedule->plan(needs, ahead_bytes);
        for (const std::uint32_t piece : schedule->evictions()) {
            count_peak(schedule->bytes_while_evicted(piece));
            item_of(piece).evict(pieces[piece].index, schedule->has_room_to_copy(piece) ? nullptr : &held);
            schedule->set_absent(piece);
            counts.resident_bytes -= plan_of(piece).bytes;
            ++counts.evictions;
            ++pieces_left;
        }
        queue.assign(schedule->loads().begin(), schedule->loads().end());
        order_ahead();
    }

    /// Gives the threads the files and pieces of the queue that they check and stage first.
    void order_ahead() {
        files_ahead.clear();
        ahead.clear();
        for (const std::uint32_t piece : queue) {
            const std::uint32_t artifact = pieces[piece].artifact;
            if (!is_checked(artifact)) {
                // Until the first picture is complete, only files that it shows.
                if ((has_uploaded || is_seen(piece)) &&
                    std::ranges::find(files_ahead, artifact) == files_ahead.end()) {
                    files_ahead.push_back(artifact);
                }
            } else if (needs_staging(piece)) {
                ahead.push_back(piece);
            }
        }
        checker->order(files_ahead);
        loader->order(ahead);
    }

    /// bytes: of pieces, with the copies that uploads need.
    void count_peak(std::uint64_t bytes) {
        counts.peak_bytes = std::max(counts.peak_bytes, bytes + patches->unused_bytes());
    }

    void count_needs() {
        schedule->count_needs(needs);
        const auto ns = static_cast<double>(read_ns.load());
        counts.read_bytes_per_s = ns > 0.0 ? static_cast<double>(read_bytes.load()) / ns * 1e9 : 0.0;
        counts.needed_bytes = schedule->needed_bytes();
        counts.worst_error = schedule->worst_error();
    }

    bool is_seen(std::uint32_t piece) const { return needs[piece].now > 1.0F; }
    /// Bytes that a call may upload while the piece is next.
    std::size_t bytes_for(std::uint32_t piece, const UploadBudget &budget) const {
        return needs[piece].now > urgent_error ? std::max(budget.bytes, budget.urgent_bytes) : budget.bytes;
    }

    /// Returns the place in the queue of the piece to upload next, or nothing if none is ready. Its parents
    /// come first. `shows_something`: this call has uploaded what is needed now.
    std::optional<std::size_t> next_piece(NotReady not_ready, bool shows_something) const {
        for (std::size_t i = 0; i < queue.size(); ++i) {
            const bool may_wait =
                not_ready != NotReady::wait_if_seen || is_seen(queue[i]) ||
                ((begun_files[pieces[queue[i]].artifact] || may_begin_file(shows_something)) &&
                 had_time(queue[i]));
            if (may_wait && can_begin(queue[i], not_ready)) {
                return i;
            }
        }
        return std::nullopt;
    }

    /// True if a call may begin a file of which nothing is seen: as long as it shows nothing, and does not
    /// wait for the check of many bytes.
    bool may_begin_file(bool shows_something) const { return !shows_something && begun_bytes < ahead_bytes; }

    /// False if this frame would wait for a piece that is not seen yet, because no thread could read it while
    /// the last frame was drawn.
    bool had_time(std::uint32_t piece) const {
        return !has_uploaded || ordered[piece] || (is_checked_of(piece) && !needs_staging(piece));
    }

    /// Lets the threads read while the frame is drawn.
    void plan_next_frame() {
        plan();
        ordered.assign(pieces.size(), false);
        for (const std::uint32_t piece : queue) {
            ordered[piece] = true;
        }
    }

    /// A plan makes room for its pieces one after another: one that begins while another is half uploaded
    /// needs room for its own copies as well.
    bool can_begin(std::uint32_t piece, NotReady not_ready) const {
        if ((current || paused) && !schedule->has_room(piece)) {
            return false;
        }
        const bool is_ready = not_ready != NotReady::skip ||
                              (is_checked_of(piece) && (!needs_staging(piece) || loader->ready(piece)));
        return is_ready && schedule->can_load(piece);
    }

    /// Lets pieces that are needed now go before one that is not and is half uploaded.
    void give_way(NotReady not_ready) {
        const auto goes_first = [&](std::uint32_t piece) {
            return is_seen(piece) && can_begin(piece, not_ready);
        };
        if (current && !paused && !is_seen(current->piece) && std::ranges::any_of(queue, goes_first)) {
            paused = std::exchange(current, std::nullopt);
        } else if (paused && !current && std::ranges::none_of(queue, goes_first)) {
            current = std::exchange(paused, std::nullopt);
        }
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
        if (!begun_files[pieces[next.piece].artifact]) {
            begun_files[pieces[next.piece].artifact] = true;
            begun_bytes += scene.artifacts[pieces[next.piece].artifact].bytes;
        }
        if (!known_checked[pieces[next.piece].artifact]) { // nor was the piece ordered
            checker->wait(pieces[next.piece].artifact);
            order_ahead();
        }
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
        item_of(next.piece).begin(pieces[next.piece].index);
        count_peak(schedule->used_bytes());
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
        counts.uploaded_bytes += chunk.bytes.size();
        if (++current->chunks_done == piece.chunks) {
            item.finish(pieces[current->piece].index);
            schedule->set_resident(current->piece);
            --pieces_left;
            ++counts.uploads;
            if (item.pieces_left == 0 && schedule->budget_bytes() == 0) {
                release(item.loaded.file); // nothing is evicted
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
    loader_ = std::make_unique<assets::ArtifactLoader>(file, folder, std::move(wanted));
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
    impl_->counts.open_ms = load.loader_->open_ms();
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // Values for attributes that a mesh lacks: normal upwards, tangent along X, colour white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    const PatchPages pages = patch_pages(file, load.limits_.vram_bytes);
    impl_->patches = std::make_shared<PatchPool>(pages.page_bytes, pages.slack_bytes);
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
        const std::uint32_t index = load.loader_->wanted()[i];
        impl_->items[index] =
            std::make_shared<StreamItem>(file.artifacts[index], std::move(loaded[i]), impl_->patches);
    }
    for (const std::uint32_t index : order) {
        impl_->add_pieces(index);
    }
    impl_->make_schedule(load.limits_);
    impl_->max_waiting_bytes = load.limits_.ram_bytes;
    impl_->known_checked.resize(impl_->items.size());
    impl_->begun_files.resize(impl_->items.size());
    impl_->checker = std::make_unique<assets::FileChecker>(
        load.loader_->wanted(), impl_->items.size(),
        [impl = impl_.get()](std::uint32_t artifact, const std::stop_token &stop) {
            impl->check(artifact, stop);
        });
    impl_->loader = std::make_unique<assets::PieceLoader>(
        impl_->pieces.size(), [impl = impl_.get()](std::uint32_t piece, assets::Inflater &inflater) {
            const Clock::time_point start = Clock::now();
            assets::StagedPiece staged =
                assets::stage(impl->item_of(piece).loaded, impl->plan_of(piece), inflater);
            impl->count_read(impl->plan_of(piece).bytes, start);
            return staged;
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

void Streamer::begin_reading() {
    impl_->plan();
}

bool Streamer::upload(const UploadBudget &budget) {
    const auto start = Clock::now();
    if (impl_->has_uploaded) {
        impl_->checker->begin_rest();
    }
    if (budget.not_ready == NotReady::skip) {
        impl_->checker->finished(); // throws if a file is wrong
    }
    if (settled()) {
        return true;
    }
    impl_->plan();
    impl_->begun_bytes = 0;
    std::size_t used = 0;
    bool shows_something = false;
    while (true) {
        if (!impl_->current && impl_->queue.empty()) {
            impl_->plan();
        }
        impl_->give_way(budget.not_ready);
        if (!impl_->current) {
            const std::optional<std::size_t> place = impl_->next_piece(budget.not_ready, shows_something);
            if (!place || used >= impl_->bytes_for(impl_->queue[*place], budget)) {
                break; // waits for no file that this frame does not use
            }
            impl_->begin(*place);
            continue;
        }
        const std::size_t bytes = impl_->next_chunk().bytes.size();
        const bool late = std::chrono::duration<double, std::milli>(Clock::now() - start).count() > budget.ms;
        if (used != 0 && (used + bytes > impl_->bytes_for(impl_->current->piece, budget) || late)) {
            break;
        }
        used += bytes;
        shows_something = shows_something || impl_->is_seen(impl_->current->piece);
        impl_->upload_next();
    }
    impl_->has_uploaded = true;
    const bool done = !impl_->current && !impl_->paused && impl_->queue.empty();
    impl_->plan_next_frame();
    impl_->count_needs();
    return done;
}

void Streamer::finish_checks() {
    impl_->checker->finish();
}

bool Streamer::checked() {
    return impl_->checker->finished();
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
