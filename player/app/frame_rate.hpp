#pragma once
// --fps: which qualities reach a frame time with the least error, and how they are held. Knows no GL and no
// clock.

#include "scene/quality.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace paradize {

/// What a trade costs and errs at one of its tiers.
struct FeatureCost {
    double ms = 0.0;    // more than at `fast`; may be below 0
    double error = 0.0; // mean FLIP to the reference, all other trades balanced
};
/// By trade and tier.
using FeatureCosts = std::array<std::array<FeatureCost, tier_names.size()>, feature_count>;

/// One quality, as predicted: times and errors add up.
struct PredictedQuality {
    Quality quality{};
    double ms = 0.0;
    double error = 0.0;
};

/// All qualities that no other one beats in both time and error, from the fastest to the most exact;
/// `base_ms` is the frame with all of `trades` at
/// `fast`; other trades stay balanced. The front is kept trade by trade (G. Nemhauser, Z.
/// Ullmann, "Discrete Dynamic Programming and Capital Allocation", 1969), which loses none of them.
std::vector<PredictedQuality> pareto_front(const FeatureCosts &table,
                                           std::span<const QualityFeature> features, double base_ms);

/// The one with the least error whose time is at most `budget_ms`; 0, the fastest, when none is.
std::size_t choose(const std::vector<PredictedQuality> &front, double budget_ms);

/// Holds a frame time. Decides once a window of frames, by their median: slower than the budget, it moves to
/// what the corrected prediction allows, at least one step down; faster, it moves up only when the better
/// quality is predicted well inside the budget for several windows on end. A step up that had to be taken
/// back doubles the wait before the next, so that it does not swing.
class FrameGovernor {
  public:
    static constexpr std::size_t window_frames = 20;
    static constexpr int first_wait_windows = 3; // windows
    static constexpr int max_wait_windows = 1 << 20;

    /// `front` is not empty, from the fastest to the most exact.
    FrameGovernor(std::vector<PredictedQuality> front, double budget_ms);

    const PredictedQuality &current() const { return front_[index_]; }
    double budget_ms() const { return budget_ms_; }
    int changes() const { return changes_; }
    /// Is even the fastest too slow, as far as has been seen?
    bool out_of_reach() const;
    /// Time of a finished frame. True when the quality is another from now on.
    bool observe(double frame_ms);

  private:
    bool move_to(std::size_t index);

    std::vector<PredictedQuality> front_;
    double budget_ms_;
    std::size_t index_;
    double scale_ = 1.0; // measured over predicted
    std::vector<double> window_;
    int fast_windows_ = 0; // windows in which a better quality would have fitted
    int wait_windows_ = first_wait_windows;
    bool stepped_up_ = false; // the last change was a step up
    int changes_ = 0;
};

} // namespace paradize
