#include "app/frame_rate.hpp"

#include "app/report.hpp"

#include <algorithm>

namespace paradize {

namespace {

constexpr double slack = 1.03;    // a median above so much of the budget is too slow
constexpr double headroom = 0.85; // a better quality must be predicted below so much of it

/// Only what no other one beats, from the fastest to the most exact.
void keep_front(std::vector<Choice> &choices) {
    std::ranges::stable_sort(choices, [](const Choice &a, const Choice &b) {
        return a.ms != b.ms ? a.ms < b.ms : a.error < b.error;
    });
    std::vector<Choice> front;
    for (const Choice &choice : choices) {
        if (front.empty() || choice.error < front.back().error) {
            front.push_back(choice);
        }
    }
    choices = std::move(front);
}

} // namespace

std::vector<Choice> quality_front(const TradeTable &table, std::span<const QualityFeature> trades,
                                  double base_ms) {
    std::vector<Choice> front{{all_at(Tier::balanced), base_ms, 0.0}};
    for (const QualityFeature named : trades) {
        const auto trade = static_cast<std::size_t>(named);
        std::vector<Choice> longer;
        for (const Choice &choice : front) {
            for (std::size_t tier = 0; tier < tier_names.size(); ++tier) {
                Choice &next = longer.emplace_back(choice);
                next.quality[trade] = static_cast<Tier>(tier);
                next.ms += table[trade][tier].ms;
                next.error += table[trade][tier].error;
            }
        }
        keep_front(longer);
        front = std::move(longer);
    }
    return front;
}

std::size_t choose(const std::vector<Choice> &front, double budget_ms) {
    const auto above = std::ranges::find_if(front, [&](const Choice &c) { return c.ms > budget_ms; });
    const auto count = static_cast<std::size_t>(above - front.begin());
    return count == 0 ? 0 : count - 1;
}

FrameGovernor::FrameGovernor(std::vector<Choice> front, double budget_ms)
    : front_(std::move(front)), budget_ms_(budget_ms), at_(choose(front_, budget_ms)) {
    window_.reserve(window_frames);
}

bool FrameGovernor::out_of_reach() const {
    return at_ == 0 && front_[0].ms * scale_ > budget_ms_;
}

bool FrameGovernor::move_to(std::size_t place) {
    const bool moved = place != at_;
    at_ = place;
    changes_ += moved ? 1 : 0;
    calm_ = 0;
    return moved;
}

bool FrameGovernor::observe(double frame_ms) {
    window_.push_back(frame_ms);
    if (window_.size() < window_frames) {
        return false;
    }
    const double measured_ms = median(window_);
    window_.clear();
    scale_ = measured_ms / std::max(front_[at_].ms, 1e-6);
    if (measured_ms > slack * budget_ms_) {
        if (raised_) {
            patience_ = std::min(2 * patience_, most_patience);
        }
        raised_ = false;
        const std::size_t fits = choose(front_, budget_ms_ / scale_);
        return move_to(std::min(fits, at_ == 0 ? 0 : at_ - 1));
    }
    const std::size_t better = choose(front_, headroom * budget_ms_ / scale_);
    calm_ = better > at_ ? calm_ + 1 : 0;
    if (calm_ < patience_) {
        return false;
    }
    raised_ = true;
    return move_to(better);
}

} // namespace paradize
