#include "streaming/uploads.hpp"

#include "error.hpp"

#include <algorithm>
#include <sys/resource.h>
#include <utility>

namespace paradize {

namespace {

constexpr std::uint64_t largest_page_bytes = std::uint64_t{16} << 20U; // of terrain patches
constexpr std::uint64_t smallest_page_bytes = std::uint64_t{1} << 20U;
constexpr float urgent_error = 2.0F; // as a multiple of the accepted one

} // namespace

std::size_t files_to_keep_open() {
    constexpr std::size_t most = 256;
    rlimit limit{};
    const bool known = ::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
    return known ? std::min<std::size_t>(most, limit.rlim_cur / 4) : most;
}

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

Uploads::Uploads(const assets::SceneFile &file) : scene(file) {
    if (scene.terrain) {
        for (const std::string &name : scene.terrain->tiles) {
            tiles.push_back(static_cast<std::uint32_t>(scene.find_artifact(name) - scene.artifacts.data()));
        }
    }
}

const assets::Piece &Uploads::plan_of(std::uint32_t piece) const {
    return item_of(piece).loaded.plan.pieces[pieces[piece].index];
}

bool Uploads::is_checked(std::uint32_t artifact) const {
    if (!known_checked[artifact]) {
        known_checked[artifact] = checker->checked(artifact);
    }
    return known_checked[artifact];
}

bool Uploads::needs_staging(std::uint32_t piece) const {
    return assets::needs_staging(item_of(piece).loaded, plan_of(piece));
}

void Uploads::add_pieces(std::uint32_t index) {
    first_piece[index] = static_cast<std::uint32_t>(pieces.size());
    const StreamItem &item = *items[index];
    for (std::uint32_t i = 0; i < item.loaded.plan.pieces.size(); ++i) {
        pieces.push_back({index, i});
        counts.total_bytes += item.loaded.plan.pieces[i].bytes;
        counts.terrain_bytes += item.loaded.tile ? item.loaded.plan.pieces[i].bytes : 0;
    }
}

/// Counts a file that stays open, if it does.
struct Uploads::OpenFile {
    explicit OpenFile(Uploads &of) : free(of.kept_open.fetch_add(1) < of.most_kept_open), uploads(of) {}
    ~OpenFile() {
        if (!taken) {
            uploads.kept_open.fetch_sub(1);
        }
    }
    OpenFile(const OpenFile &) = delete;
    OpenFile &operator=(const OpenFile &) = delete;

    const bool free;
    bool taken = false;
    Uploads &uploads;
};

bool Uploads::open_if_checked(std::uint32_t artifact) {
    const assets::Artifact &entry = scene.artifacts[artifact];
    assets::LoadedArtifact &loaded = items[artifact]->loaded;
    const assets::FileStamp version = assets::stamp_of(loaded.path);
    OpenFile slot(*this);
    if (!slot.free || !checked_files->holds(entry, version) || !loaded.file.keep_open(loaded.path, version)) {
        return false;
    }
    loaded.checked_ns = assets::now_ns();
    if (loaded.plan.pieces.empty()) {
        loaded.file.release(); // nothing of it is drawn
    }
    slot.taken = loaded.file.is_open();
    return true;
}

void Uploads::check(std::uint32_t artifact, const std::stop_token &stop) {
    if (!open_if_checked(artifact)) {
        check_all_of(artifact, stop);
    }
    if (unchecked_files.fetch_sub(1) == 1) {
        checked_files->save(true);
    }
}

void Uploads::check_all_of(std::uint32_t artifact, const std::stop_token &stop) {
    assets::LoadedArtifact &loaded = items[artifact]->loaded;
    const Clock::time_point start = Clock::now();
    loaded.checked_ns = assets::now_ns();
    OpenFile slot(*this);
    // what waits for all of a scene reads it again at once
    assets::check_artifact(scene.artifacts[artifact], loaded, slot.free && takes_all, stop);
    checked_files->add(scene.artifacts[artifact], loaded.file.stamp(), loaded.checked_ns);
    count_read(scene.artifacts[artifact].bytes, start);
    const std::uint64_t bytes = loaded.file.in_memory() ? loaded.file.bytes().size() : 0;
    if (waiting_bytes.fetch_add(bytes) + bytes > max_waiting_bytes && loaded.file.in_memory()) {
        free_memory(loaded, slot.free);
        if (!loaded.file.in_memory()) { // else no time stamp proves that the file stays the same
            waiting_bytes.fetch_sub(bytes);
        }
    }
    slot.taken = loaded.file.is_open();
}

void Uploads::count_read(std::uint64_t bytes, Clock::time_point since) {
    read_bytes += bytes;
    read_ns += static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - since).count());
}

void Uploads::release(assets::FileBytes &file) {
    if (file.in_memory()) {
        waiting_bytes.fetch_sub(file.bytes().size());
    } else if (file.is_open()) {
        kept_open.fetch_sub(1);
    }
    file.release();
}

void Uploads::make_schedule(const MemoryLimits &limits) {
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
    paused.reserve(most_paused);
    ahead.reserve(pieces.size());
    files_ahead.reserve(items.size());
    in_files_ahead.resize(items.size());
}

std::shared_ptr<StreamItem> Uploads::find_reusable(const assets::SceneFile &other,
                                                   const assets::Artifact &artifact) const {
    const std::optional<std::uint32_t> tile = tile_of(other, artifact);
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const StreamItem &item = *items[i];
        if (item.loaded.sha256 == artifact.sha256 && item.kind == artifact.kind && item.pieces_left == 0 &&
            is_checked(i) && item.drawn == artifact.drawn &&
            item.loaded.tile.has_value() == tile.has_value() &&
            (!tile || fits_tile(item.loaded.glb, *other.terrain, *tile))) {
            return items[i];
        }
    }
    return nullptr;
}

void Uploads::plan() {
    schedule->plan(needs, ahead_bytes);
    for (const std::uint32_t piece : schedule->evictions()) {
        count_peak(schedule->bytes_while_evicted(piece));
        item_of(piece).evict(pieces[piece].index, schedule->has_room_to_copy(piece) ? nullptr : &held);
        schedule->set_absent(piece);
        counts.resident_bytes -= plan_of(piece).bytes;
        ++counts.evictions;
        if (!lost[pieces[piece].artifact]) {
            ++pieces_left;
        } else {
            schedule->give_up(piece);
        }
    }
    queue.assign(schedule->loads().begin(), schedule->loads().end());
    if (takes_all) {
        std::ranges::sort(queue); // file after file, as they are checked
    }
    order_ahead();
}

void Uploads::order_ahead() {
    files_ahead.clear();
    in_files_ahead.assign(items.size(), false);
    ahead.clear();
    for (const std::uint32_t piece : queue) {
        const std::uint32_t artifact = pieces[piece].artifact;
        if (!is_checked(artifact)) {
            // Until the first picture is complete, only files that it shows.
            if ((has_uploaded || is_seen(piece)) && !in_files_ahead[artifact]) {
                in_files_ahead[artifact] = true;
                files_ahead.push_back(artifact);
            }
        } else if (is_staged(piece)) {
            ahead.push_back(piece);
        }
    }
    checker->order(files_ahead);
    loader->order(ahead);
}

void Uploads::count_peak(std::uint64_t bytes) {
    counts.peak_bytes = std::max(counts.peak_bytes, bytes + geometry.unused_bytes());
}

void Uploads::count_needs() {
    schedule->count_needs(needs);
    const auto ns = static_cast<double>(read_ns.load());
    counts.read_bytes_per_s = ns > 0.0 ? static_cast<double>(read_bytes.load()) / ns * 1e9 : 0.0;
    counts.needed_bytes = schedule->needed_bytes();
    counts.worst_error = schedule->worst_error();
}

std::size_t Uploads::bytes_for(std::uint32_t piece, const UploadBudget &budget) const {
    return is_urgent(piece) ? std::max(budget.bytes, budget.urgent_bytes) : budget.bytes;
}

bool Uploads::is_urgent(std::uint32_t piece) const {
    return needs[piece].now > urgent_error;
}

bool Uploads::comes_in_turn(std::uint32_t piece, const UploadBudget &budget, std::size_t used) const {
    return budget.urgent_bytes <= budget.bytes || used + plan_of(piece).bytes <= bytes_for(piece, budget);
}

bool Uploads::settled() const {
    return pieces_left == 0 && schedule->budget_bytes() == 0;
}

bool Uploads::upload(const UploadBudget &budget) {
    takes_all = budget.bytes == std::numeric_limits<std::size_t>::max() &&
                budget.not_ready == NotReady::wait && schedule->budget_bytes() == 0;
    if (takes_all) {
        checker->begin_all();
    } else if (has_uploaded) {
        checker->begin_rest();
    }
    if (budget.not_ready == NotReady::skip) {
        checker->finished(); // throws if a file is wrong
    }
    staging.begin_frame();
    if (settled()) {
        staging.close();
        return true;
    }
    if (has_uploaded && pieces_left != 0) { // the first picture waits for no buffer
        staging.open(std::min(staging_bytes, counts.total_bytes - counts.resident_bytes));
    }
    plan();
    const double start_ms = budget.now_ms(); // of many pieces a plan may take as long as the budget
    begun_bytes = 0;
    std::size_t used = 0;
    bool shows_something = false;
    while (true) {
        if (!current && queue.empty()) {
            plan();
        }
        give_way(budget, used);
        if (!current) {
            const std::optional<std::size_t> place = next_piece(budget, used, shows_something);
            if (!place) {
                break; // waits for no file that this frame does not use
            }
            begin(*place);
            continue;
        }
        const std::size_t bytes = next_chunk().bytes.size();
        const bool late = budget.now_ms() - start_ms > budget.ms;
        if (used != 0 && late) {
            break;
        }
        if (used != 0 && used + bytes > bytes_for(current->piece, budget)) {
            used = std::max(used, budget.bytes); // what is left is too little for this one
            if (!give_way(budget, used)) {
                break;
            }
            continue;
        }
        used += bytes;
        shows_something = shows_something || is_seen(current->piece);
        upload_next();
    }
    staging.end_frame();
    has_uploaded = true;
    const bool done = !current && paused.empty() && queue.empty();
    plan_next_frame();
    count_needs();
    return done;
}

std::optional<std::size_t> Uploads::next_piece(const UploadBudget &budget, std::size_t used,
                                               bool shows_something) const {
    const NotReady not_ready = budget.not_ready;
    std::optional<std::size_t> unfinished;
    for (std::size_t i = 0; i < queue.size(); ++i) {
        if (used >= bytes_for(queue[i], budget)) {
            continue;
        }
        const bool may_wait = not_ready != NotReady::wait_if_seen || is_seen(queue[i]) ||
                              ((begun_files[pieces[queue[i]].artifact] || may_begin_file(shows_something)) &&
                               had_time(queue[i]));
        if (!may_wait || !can_begin(queue[i], not_ready)) {
            continue;
        }
        if (comes_in_turn(queue[i], budget, used)) {
            return i;
        }
        unfinished = unfinished ? unfinished : i;
    }
    return unfinished;
}

bool Uploads::had_time(std::uint32_t piece) const {
    return !has_uploaded || ordered[piece] ||
           (begun_files[pieces[piece].artifact] && all_files_wait &&
            !assets::is_compressed(item_of(piece).loaded, plan_of(piece)));
}

void Uploads::plan_next_frame() {
    plan();
    ordered.assign(pieces.size(), false);
    for (const std::uint32_t piece : queue) {
        ordered[piece] = true;
    }
}

bool Uploads::can_begin(std::uint32_t piece, NotReady not_ready) const {
    if ((current || !paused.empty()) && !schedule->has_room(piece)) {
        return false;
    }
    const bool is_ready =
        not_ready != NotReady::skip || (is_checked_of(piece) && (!is_staged(piece) || loader->ready(piece)));
    return is_ready && schedule->can_load(piece);
}

bool Uploads::gives_way(std::uint32_t half, const UploadBudget &budget, std::size_t used) const {
    if (schedule->order() == UploadOrder::file) {
        return false;
    }
    const auto rank = [&](std::uint32_t piece) {
        return !is_seen(piece) ? 0 : is_urgent(piece) || plan_of(piece).coarse ? 2 : 1;
    };
    const bool spent = !is_urgent(half) && used >= budget.bytes;
    return std::ranges::any_of(queue, [&](std::uint32_t piece) {
        return (rank(piece) > rank(half) || (spent && is_urgent(piece))) && used < bytes_for(piece, budget) &&
               comes_in_turn(piece, budget, used) && can_begin(piece, budget.not_ready);
    });
}

bool Uploads::give_way(const UploadBudget &budget, std::size_t used) {
    if (current && paused.size() < most_paused && gives_way(current->piece, budget, used)) {
        paused.push_back(std::move(*current));
        current.reset();
        return true;
    }
    if (!current && !paused.empty() && !gives_way(paused.back().piece, budget, used)) {
        current = std::move(paused.back());
        paused.pop_back();
    }
    return false;
}

void Uploads::give_up(std::uint32_t artifact, std::string error) {
    failures.push_back(std::move(error));
    lost[artifact] = true;
    for (std::uint32_t i = 0; i < items[artifact]->loaded.plan.pieces.size(); ++i) {
        pieces_left -= schedule->give_up(first_piece[artifact] + i) ? 1 : 0;
    }
    plan();
}

void Uploads::begin(std::size_t place) {
    Current next;
    next.piece = queue[place];
    if (!begun_files[pieces[next.piece].artifact]) {
        begun_files[pieces[next.piece].artifact] = true;
        begun_bytes += scene.artifacts[pieces[next.piece].artifact].bytes;
    }
    if (!known_checked[pieces[next.piece].artifact]) { // nor were its pieces ordered
        checker->wait(pieces[next.piece].artifact);
        order_ahead();
    }
    if (is_staged(next.piece)) {
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
    item_of(next.piece).begin(pieces[next.piece].index, takes_all);
    count_peak(schedule->used_bytes());
    current = std::move(next);
}

const assets::UploadChunk &Uploads::next_chunk() const {
    return item_of(current->piece).loaded.plan.chunks_of(plan_of(current->piece))[current->chunks_done];
}

void Uploads::upload_next() {
    StreamItem &item = item_of(current->piece);
    const assets::Piece &piece = plan_of(current->piece);
    const assets::UploadChunk &chunk = next_chunk();
    item.upload(chunk, current->staged ? staging.source(current->staged, current->bytes_done)
                                       : gl::Source{chunk.bytes.data()});
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
        staging.finish(std::move(current->staged));
        current.reset();
    }
}

} // namespace paradize
