#pragma once
// The work of a Streamer in a frame: its pieces, what is needed of them, what is checked, read and uploaded
// next.

#include "assets/checked_files.hpp"
#include "assets/file_checker.hpp"
#include "assets/piece_loader.hpp"
#include "assets/scene/file.hpp"
#include "assets/upload_plan.hpp"
#include "streaming/geometry_pool.hpp"
#include "streaming/schedule.hpp"
#include "streaming/staging.hpp"
#include "streaming/stream_item.hpp"
#include "streaming/streamer.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace paradize {

/// A piece of the scene.
struct ScenePiece {
    std::uint32_t artifact = 0; // index into SceneFile::artifacts
    std::uint32_t index = 0;    // into the artifact's plan
};

/// How terrain patches share buffers: see GeometryPool.
struct PatchPages {
    std::uint64_t page_bytes = 0; // 0: each block has buffers of its own
    std::uint64_t slack_bytes = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t reserve_bytes = 0; // of the limit, for what is unused of pages
};
/// vram_bytes: the limit; 0: none.
PatchPages patch_pages(const assets::SceneFile &scene, std::uint64_t vram_bytes);

/// Of files that are checked and not in memory: a quarter of those that a process may have open, as two
/// scenes may be loaded at once, at most 256.
std::size_t files_to_keep_open();

struct Uploads {
    using Clock = std::chrono::steady_clock;
    static constexpr std::uint64_t ahead_bytes = std::uint64_t{16} << 20U; // staged ahead, or one piece
    static constexpr std::uint64_t staging_bytes = ahead_bytes;            // of the mapped buffer

    const assets::SceneFile &scene;
    GeometryPools geometry;
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
    std::vector<bool> lost; // per artifact: its file cannot be read any more
    Staging staging;

    /// The piece that is being uploaded.
    struct Current {
        std::uint32_t piece = 0; // of the scene
        std::uint32_t chunks_done = 0;
        std::uint64_t bytes_done = 0;
        assets::StagedBytes staged; // nullptr: the chunks are in memory
    };
    std::optional<Current> current;
    static constexpr std::size_t most_paused = 3;
    std::vector<Current> paused;              // gave way to those that show more; the last one goes on first
    std::vector<std::uint32_t> ahead;         // pieces for the loader
    std::vector<std::uint32_t> files_ahead;   // artifacts for the checker
    std::vector<bool> in_files_ahead;         // per artifact
    std::atomic<bool> takes_all = false;      // this call of upload() waits for all pieces
    bool has_uploaded = false;                // upload() was called
    std::vector<bool> begun_files;            // per artifact: a piece of it was begun
    std::uint64_t begun_bytes = 0;            // of the files that the last call began
    std::vector<bool> ordered;                // per piece: planned at the end of the last call
    mutable std::vector<bool> known_checked;  // per artifact: what the checker said last
    std::atomic<std::uint64_t> waiting_bytes; // of checked files that stay in memory until they are uploaded
    std::uint64_t max_waiting_bytes = 0;
    bool all_files_wait = false; // in memory: together they stay below max_waiting_bytes
    std::unique_ptr<assets::CheckedFiles> checked_files;
    std::atomic<std::size_t> unchecked_files; // that check() has not returned for yet
    struct OpenFile;
    std::atomic<std::size_t> kept_open; // files without memory, of which pieces are read
    std::size_t most_kept_open = 0;
    std::atomic<std::uint64_t> read_bytes, read_ns; // by the threads, and how long that took them
    // The last members: their threads use the others.
    std::unique_ptr<assets::FileChecker> checker;
    std::unique_ptr<assets::PieceLoader> loader;

    explicit Uploads(const assets::SceneFile &file);

    /// As Streamer::upload() and settled().
    bool upload(const UploadBudget &budget);
    bool settled() const;

    StreamItem &item_of(std::uint32_t piece) const { return *items[pieces[piece].artifact]; }
    const assets::Piece &plan_of(std::uint32_t piece) const;
    bool is_checked(std::uint32_t artifact) const;
    bool is_checked_of(std::uint32_t piece) const { return is_checked(pieces[piece].artifact); }
    /// The piece's file must be checked.
    bool needs_staging(std::uint32_t piece) const;
    /// True if the loader stages the piece, also where it could be uploaded from the file's memory.
    bool is_staged(std::uint32_t piece) const { return staging.is_open() || needs_staging(piece); }

    /// Adds the pieces of an artifact to those of the scene.
    void add_pieces(std::uint32_t index);

    /// Checks an artifact's file, or opens it if an earlier start has checked it. Runs on the checker's
    /// threads, once for each file. Beyond `max_waiting_bytes` its memory, if it took any, is freed.
    void check(std::uint32_t artifact, const std::stop_token &stop);
    /// Opens a file that an earlier start has checked, for its pieces to be read. False if it must be
    /// checked.
    bool open_if_checked(std::uint32_t artifact);
    void check_all_of(std::uint32_t artifact, const std::stop_token &stop);

    void count_read(std::uint64_t bytes, Clock::time_point since);

    /// Frees the memory of a file that is not needed any more.
    void release(assets::FileBytes &file);

    /// Creates the schedule of all pieces. A piece's parent is the next coarser one. Those of terrain have
    /// none: a cut uses what is resident, and a patch is never needed more than those that it replaces.
    void make_schedule(const MemoryLimits &limits);

    /// Returns a complete item for an artifact of another scene, or nullptr if there is none.
    std::shared_ptr<StreamItem> find_reusable(const assets::SceneFile &other,
                                              const assets::Artifact &artifact) const;

    /// Plans, evicts, and lets the loader stage the next pieces.
    void plan();

    /// Gives the threads the files and pieces of the queue that they check and stage first.
    void order_ahead();

    /// bytes: of pieces, with the copies that uploads need.
    void count_peak(std::uint64_t bytes);

    void count_needs();

    bool is_seen(std::uint32_t piece) const { return needs[piece].now > 1.0F; }
    bool is_urgent(std::uint32_t piece) const; // its absence shows much
    /// Bytes that a call may upload while the piece is next.
    std::size_t bytes_for(std::uint32_t piece, const UploadBudget &budget) const;
    /// False for a piece that a larger budget for what shows much cannot finish: the frame would not show it.
    /// It comes after those that the budget can finish.
    bool comes_in_turn(std::uint32_t piece, const UploadBudget &budget, std::size_t used) const;

    /// Returns the place in the queue of the piece to upload next, or nothing if none is ready. Its parents
    /// come first. `shows_something`: this call has uploaded what is needed now.
    /// used: bytes that this call has uploaded.
    std::optional<std::size_t> next_piece(const UploadBudget &budget, std::size_t used,
                                          bool shows_something) const;

    /// True if a call may begin a file of which nothing is seen: as long as it shows nothing, and does not
    /// wait for the check of many bytes.
    bool may_begin_file(bool shows_something) const { return !shows_something && begun_bytes < ahead_bytes; }

    /// False if this frame might wait for a piece that is not seen yet, because no thread could read it while
    /// the last frame was drawn. How far the threads have come makes no difference, or frames would depend on
    /// timing.
    bool had_time(std::uint32_t piece) const;

    /// Lets the threads read while the frame is drawn.
    void plan_next_frame();

    /// A plan makes room for its pieces one after another: one that begins while another is half uploaded
    /// needs room for its own copies as well.
    bool can_begin(std::uint32_t piece, NotReady not_ready) const;

    /// True if a piece that is half uploaded gives way to one that shows more: what is not seen to what is,
    /// a finer piece also to a coarse one and to one whose absence shows much. A coarse one too gives way to
    /// that, once it has used up its share of the budget. used: bytes that this call has uploaded.
    bool gives_way(std::uint32_t half, const UploadBudget &budget, std::size_t used) const;
    /// Pauses the piece that is half uploaded if it gives way; else lets the last paused one go on if there
    /// is no other. True if it has paused one.
    bool give_way(const UploadBudget &budget, std::size_t used);

    /// Drops all pieces of an artifact whose file cannot be read any more.
    void give_up(std::uint32_t artifact, std::string error);

    /// Begins the piece at this place of the queue.
    void begin(std::size_t place);

    const assets::UploadChunk &next_chunk() const;

    void upload_next();
};

} // namespace paradize
