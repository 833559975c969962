#pragma once
// A thread that stages pieces for the drawing thread, so that this waits neither for the disk nor for
// Zstandard.

#include "assets/loaded_artifact.hpp"

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace paradize::assets {

class PieceLoader {
  public:
    using Stage = std::function<StagedPiece(std::uint32_t piece, StageMemory &memory)>;

    /// `stage` runs on the thread. Pieces are numbered from 0 to `pieces` - 1.
    PieceLoader(std::size_t pieces, Stage stage);
    ~PieceLoader();
    PieceLoader(const PieceLoader &) = delete;
    PieceLoader &operator=(const PieceLoader &) = delete;

    /// Replaces the orders. The thread stages them in this sequence. Pieces that are no longer ordered are
    /// dropped.
    void order(std::span<const std::uint32_t> pieces);
    bool ready(std::uint32_t piece) const;
    /// Waits until the piece is staged, and takes it. One that is not ordered is staged next.
    StagedPiece take(std::uint32_t piece);

  private:
    void work(const std::stop_token &stop);

    const Stage stage_;
    mutable std::mutex mutex_; // guards all but the thread
    std::condition_variable_any changed_;
    std::vector<std::uint32_t> orders_, dropped_; // capacity for all pieces
    struct Slot {
        StagedPiece piece;
        bool ready = false;
        bool ordered = false;
    };
    std::vector<Slot> slots_; // one per piece
    std::jthread thread_;
};

} // namespace paradize::assets
