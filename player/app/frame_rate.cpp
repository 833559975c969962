#include "app/frame_rate.hpp"

#include "app/report.hpp"

#include <algorithm>

namespace paradize {

namespace {

constexpr double slack = 1.03;    // a median above this share of the budget is too slow
constexpr double headroom = 0.85; // a better quality must be predicted below this share of the budget

/// Keeps the Pareto front: the choices that no other choice beats in both time and error. Sorts them from the
/// fastest to the most exact.
void keep_pareto_front(std::vector<PredictedQuality> &choices) {
    std::ranges::stable_sort(choices, [](const PredictedQuality &a, const PredictedQuality &b) {
        return a.ms != b.ms ? a.ms < b.ms : a.error < b.error;
    });
    std::vector<PredictedQuality> front;
    for (const PredictedQuality &choice : choices) {
        if (front.empty() || choice.error < front.back().error) {
            front.push_back(choice);
        }
    }
    choices = std::move(front);
}

} // namespace

std::vector<PredictedQuality> pareto_front(const FeatureCosts &table,
                                           std::span<const QualityFeature> features, double base_ms) {
    std::vector<PredictedQuality> front{{all_at(Tier::balanced), base_ms, 0.0}};
    for (const QualityFeature named : features) {
        const auto feature = static_cast<std::size_t>(named);
        std::vector<PredictedQuality> longer;
        for (const PredictedQuality &choice : front) {
            for (std::size_t tier = 0; tier < tier_names.size(); ++tier) {
                PredictedQuality &next = longer.emplace_back(choice);
                next.quality[feature] = static_cast<Tier>(tier);
                next.ms += table[feature][tier].ms;
                next.error += table[feature][tier].error;
            }
        }
        keep_pareto_front(longer);
        front = std::move(longer);
    }
    return front;
}

std::size_t choose(const std::vector<PredictedQuality> &front, double budget_ms) {
    const auto above =
        std::ranges::find_if(front, [&](const PredictedQuality &c) { return c.ms > budget_ms; });
    const auto count = static_cast<std::size_t>(above - front.begin());
    return count == 0 ? 0 : count - 1;
}

FrameGovernor::FrameGovernor(std::vector<PredictedQuality> front, double budget_ms)
    : front_(std::move(front)), budget_ms_(budget_ms), index_(choose(front_, budget_ms)) {
    window_.reserve(window_frames);
}

bool FrameGovernor::out_of_reach() const {
    return index_ == 0 && front_[0].ms * scale_ > budget_ms_;
}

bool FrameGovernor::move_to(std::size_t index) {
    const bool moved = index != index_;
    index_ = index;
    changes_ += moved ? 1 : 0;
    fast_windows_ = 0;
    return moved;
}

bool FrameGovernor::observe(double frame_ms) {
    window_.push_back(frame_ms);
    if (window_.size() < window_frames) {
        return false;
    }
    const double measured_ms = median(window_);
    window_.clear();
    scale_ = measured_ms / std::max(front_[index_].ms, 1e-6);
    if (measured_ms > slack * budget_ms_) {
        if (stepped_up_) {
            wait_windows_ = std::min(2 * wait_windows_, max_wait_windows);
        }
        stepped_up_ = false;
        const std::size_t fits = choose(front_, budget_ms_ / scale_);
        return move_to(std::min(fits, index_ == 0 ? 0 : index_ - 1));
    }
    const std::size_t better = choose(front_, headroom * budget_ms_ / scale_);
    fast_windows_ = better > index_ ? fast_windows_ + 1 : 0;
    if (fast_windows_ < wait_windows_) {
        return false;
    }
    stepped_up_ = true;
    return move_to(better);
}

} // namespace paradize
