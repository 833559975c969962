#pragma once
// Decides which pieces to load and which to evict. Uses no GL, no files and no clock.

#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

struct ScheduledPiece {
    std::uint64_t bytes = 0;         // on the device
    std::uint64_t working_bytes = 0; // more while it is uploaded, or copied on the device to be evicted
    bool coarse = false;             // loaded before all finer pieces of what is seen, even beyond the limit
    // Pieces that must be resident before this one, and as long as it is. They come earlier in the list, and
    // are needed at least as much.
    std::vector<std::uint32_t> parents;
};

/// The error on screen while a piece is absent, relative to the accepted error: above 1 the piece is needed.
struct Need {
    float now = 0.0F;
    float soon = 0.0F; // along the flight, less the later it is
};

/// The order of loading without a limit of memory: the most needed first, or the coarse pieces and then all
/// others as they are listed. The second is there to compare with.
enum class UploadOrder : std::uint8_t { needs, file };

class Schedule {
  public:
    /// `budget_bytes` 0: no limit, everything is loaded in the end.
    Schedule(std::vector<ScheduledPiece> pieces, std::uint64_t budget_bytes,
             UploadOrder order = UploadOrder::needs);
    UploadOrder order() const { return order_; }

    /// Finds what to load next and what to evict first. A piece that is needed now is never evicted. Loads
    /// come in this order: coarse pieces that are needed now; other pieces that are needed now; those that
    /// are needed soon; of each the largest error first; coarse pieces; without a limit all others. So what
    /// is needed soon has the room that is left by what is needed now. Another piece is evicted only for one
    /// of a group before its own, or for one of the same group that has several times its error, or while
    /// the limit is exceeded; a coarse piece only for one that is needed now. `ahead_bytes` limits the
    /// loads, but not the first one.
    /// Allocates nothing.
    void plan(std::span<const Need> needs, std::uint64_t ahead_bytes);
    std::span<const std::uint32_t> loads() const { return loads_; }
    std::span<const std::uint32_t> evictions() const { return evictions_; } // children before parents

    /// Report what was done. A loading piece counts as used memory, with its working bytes, however long it
    /// takes.
    void set_loading(std::uint32_t piece);
    void set_resident(std::uint32_t piece); // from loading
    void set_absent(std::uint32_t piece);
    /// The piece cannot be loaded any more. False if it is resident, or was given up before.
    bool give_up(std::uint32_t piece);

    /// True if all parents are resident.
    bool can_load(std::uint32_t piece) const;

    /// True if the piece fits the limit now, with its working bytes.
    bool has_room(std::uint32_t piece) const { return fits(piece, used_bytes_); }
    /// True if a copy of the working bytes of a resident piece fits the limit beside it.
    bool has_room_to_copy(std::uint32_t piece) const {
        return budget_bytes_ == 0 || used_bytes_ + pieces_[piece].working_bytes <= budget_bytes_;
    }
    /// Bytes on the device while a resident piece is evicted.
    std::uint64_t bytes_while_evicted(std::uint32_t piece) const {
        return used_bytes_ + (has_room_to_copy(piece) ? pieces_[piece].working_bytes : 0);
    }

    bool resident(std::uint32_t piece) const { return states_[piece] == State::resident; }
    std::uint64_t budget_bytes() const { return budget_bytes_; }
    std::uint64_t used_bytes() const { return used_bytes_; }
    /// Counts what the next two return. plan() does it too.
    void count_needs(std::span<const Need> needs);
    /// Bytes of all pieces that are needed now, and the largest error of those that are not resident (0:
    /// none).
    std::uint64_t needed_bytes() const { return needed_bytes_; }
    float worst_error() const { return worst_error_; }

  private:
    enum class State : std::uint8_t { absent, loading, resident, given_up };
    struct Rank {
        int group = 0; // smaller comes first
        float error = 0.0F;
    };
    Rank rank(std::uint32_t piece, const Need &need) const;
    bool fits(std::uint32_t piece, std::uint64_t used) const {
        return budget_bytes_ == 0 ||
               used + pieces_[piece].bytes + pieces_[piece].working_bytes <= budget_bytes_;
    }
    bool comes_before(std::uint32_t a, std::uint32_t b) const;
    bool may_replace(std::uint32_t piece, std::uint32_t victim) const;
    void plan_eviction(std::uint32_t victim, std::uint64_t &used);
    bool make_room(std::uint32_t piece, std::uint64_t &used);

    std::vector<ScheduledPiece> pieces_;
    std::uint64_t budget_bytes_ = 0;
    UploadOrder order_ = UploadOrder::needs;
    std::uint64_t used_bytes_ = 0, needed_bytes_ = 0;
    float worst_error_ = 0.0F;
    std::vector<State> states_;
    std::vector<std::uint32_t> children_; // per piece: loading and resident children
    // Of one plan.
    std::vector<std::uint32_t> loads_, evictions_;
    std::vector<std::uint32_t> candidates_, victims_; // victims: the least needed first
    std::vector<std::uint32_t> kept_children_;
    std::vector<Rank> ranks_;
    std::vector<bool> planned_, evicted_;
};

} // namespace paradize
