#include "streaming/schedule.hpp"

#include <algorithm>
#include <utility>

namespace paradize {

namespace {

/// The groups of Schedule::plan(), first to last.
enum Group { seen_coarse, needed_now, needed_soon, coarse, unneeded };

// A piece that is needed soon goes only for one that has so many times its error: else pieces would go to and
// fro while errors change along the flight.
constexpr float worth_a_swap = 2.0F;

} // namespace

Schedule::Schedule(std::vector<ScheduledPiece> pieces, std::uint64_t budget_bytes, UploadOrder order)
    : pieces_(std::move(pieces)), budget_bytes_(budget_bytes), order_(order), states_(pieces_.size()),
      children_(pieces_.size()), ranks_(pieces_.size()), planned_(pieces_.size()), evicted_(pieces_.size()) {
    for (std::vector<std::uint32_t> *list : {&loads_, &evictions_, &candidates_, &victims_}) {
        list->reserve(pieces_.size());
    }
    kept_children_.reserve(pieces_.size());
}

Schedule::Rank Schedule::rank(std::uint32_t piece, const Need &need) const {
    if (order_ == UploadOrder::file && budget_bytes_ == 0) {
        return {pieces_[piece].coarse ? coarse : unneeded, 0.0F};
    }
    const bool is_coarse = pieces_[piece].coarse;
    if (need.now > 1.0F) {
        return {is_coarse ? seen_coarse : needed_now, need.now};
    }
    if (need.soon > 1.0F) {
        return {needed_soon, need.soon};
    }
    return {is_coarse ? coarse : unneeded, 0.0F};
}

void Schedule::count_needs(std::span<const Need> needs) {
    needed_bytes_ = 0;
    worst_error_ = 0.0F;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
        if (needs[i].now > 1.0F) {
            needed_bytes_ += pieces_[i].bytes;
            worst_error_ = std::max(worst_error_, states_[i] == State::resident ? 0.0F : needs[i].now);
        }
    }
}

void Schedule::plan(std::span<const Need> needs, std::uint64_t ahead_bytes) {
    count_needs(needs);
    candidates_.clear();
    victims_.clear();
    for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
        ranks_[i] = rank(i, needs[i]);
        if (states_[i] == State::absent && (ranks_[i].group != unneeded || budget_bytes_ == 0)) {
            candidates_.push_back(i);
        } else if (states_[i] == State::resident && needs[i].now <= 1.0F) {
            victims_.push_back(i);
        }
    }
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        return comes_before(a, b) || (!comes_before(b, a) && a < b);
    };
    std::ranges::sort(candidates_, before);
    std::ranges::sort(victims_, [&](std::uint32_t a, std::uint32_t b) { return before(b, a); });
    loads_.clear();
    evictions_.clear();
    planned_.assign(pieces_.size(), false);
    evicted_.assign(pieces_.size(), false);
    kept_children_.assign(children_.begin(), children_.end());
    std::uint64_t used = used_bytes_;
    for (const std::uint32_t victim : victims_) { // what was seen coarsely has gone beyond the limit
        if (budget_bytes_ == 0 || used <= budget_bytes_) {
            break;
        }
        if (kept_children_[victim] == 0) {
            plan_eviction(victim, used);
        }
    }
    std::uint64_t ahead = 0;
    for (const std::uint32_t piece : candidates_) {
        if (ahead != 0 && ahead + pieces_[piece].bytes > ahead_bytes) {
            break;
        }
        const bool possible = std::ranges::all_of(pieces_[piece].parents, [&](std::uint32_t parent) {
            return (states_[parent] == State::resident || states_[parent] == State::loading ||
                    planned_[parent]) &&
                   !evicted_[parent];
        });
        if (!possible || !make_room(piece, used)) {
            continue;
        }
        for (const std::uint32_t parent : pieces_[piece].parents) {
            ++kept_children_[parent];
        }
        planned_[piece] = true;
        loads_.push_back(piece);
        used += pieces_[piece].bytes;
        ahead += pieces_[piece].bytes;
    }
}

/// True if `a` is loaded before `b`, wherever they stand in the list.
bool Schedule::comes_before(std::uint32_t a, std::uint32_t b) const {
    return ranks_[a].group != ranks_[b].group ? ranks_[a].group < ranks_[b].group
                                              : ranks_[a].error > ranks_[b].error;
}

/// True if the victim may go for the piece. Then all victims before it may.
bool Schedule::may_replace(std::uint32_t piece, std::uint32_t victim) const {
    return ranks_[piece].group != ranks_[victim].group
               ? ranks_[piece].group < ranks_[victim].group
               : ranks_[piece].error > worth_a_swap * ranks_[victim].error;
}

void Schedule::plan_eviction(std::uint32_t victim, std::uint64_t &used) {
    evicted_[victim] = true;
    evictions_.push_back(victim);
    used -= pieces_[victim].bytes;
    for (const std::uint32_t parent : pieces_[victim].parents) {
        --kept_children_[parent];
    }
}

/// Chooses pieces to evict until `piece` fits. False, and chooses none, if it does not fit.
bool Schedule::make_room(std::uint32_t piece, std::uint64_t &used) {
    const std::size_t first = evictions_.size();
    for (const std::uint32_t victim : victims_) {
        if (fits(piece, used) || !may_replace(piece, victim)) {
            break;
        }
        const bool may_go = !pieces_[victim].coarse || ranks_[piece].group <= needed_now;
        if (may_go && !evicted_[victim] && kept_children_[victim] == 0 &&
            std::ranges::find(pieces_[piece].parents, victim) == pieces_[piece].parents.end()) {
            plan_eviction(victim, used);
        }
    }
    // A coarse piece that is seen is loaded even beyond the budget: without it there is nothing to see.
    if (fits(piece, used) || ranks_[piece].group == seen_coarse) {
        return true;
    }
    for (; evictions_.size() > first; evictions_.pop_back()) {
        const std::uint32_t victim = evictions_.back();
        evicted_[victim] = false;
        used += pieces_[victim].bytes;
        for (const std::uint32_t parent : pieces_[victim].parents) {
            ++kept_children_[parent];
        }
    }
    return false;
}

void Schedule::set_loading(std::uint32_t piece) {
    states_[piece] = State::loading;
    used_bytes_ += pieces_[piece].bytes + pieces_[piece].working_bytes;
    for (const std::uint32_t parent : pieces_[piece].parents) {
        ++children_[parent];
    }
}

void Schedule::set_resident(std::uint32_t piece) {
    states_[piece] = State::resident;
    used_bytes_ -= pieces_[piece].working_bytes;
}

void Schedule::set_absent(std::uint32_t piece) {
    states_[piece] = State::absent;
    used_bytes_ -= pieces_[piece].bytes;
    for (const std::uint32_t parent : pieces_[piece].parents) {
        --children_[parent];
    }
}

bool Schedule::give_up(std::uint32_t piece) {
    if (states_[piece] != State::absent) {
        return false;
    }
    states_[piece] = State::given_up;
    return true;
}

bool Schedule::can_load(std::uint32_t piece) const {
    return std::ranges::all_of(pieces_[piece].parents,
                               [&](std::uint32_t parent) { return states_[parent] == State::resident; });
}

} // namespace paradize
