#pragma once
// --fps: chooses the qualities that reach a frame time with the least error, and holds that frame time. Uses
// no GL and no clock.

#include "scene/quality.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace paradize {

/// Cost and error of a feature at one tier.
struct FeatureCost {
    double ms = 0.0;    // added to the frame at tier `fast`; noise may make it negative
    double error = 0.0; // mean FLIP against the reference, all other features balanced
};
/// Indexed by feature, then tier.
using FeatureCosts = std::array<std::array<FeatureCost, tier_names.size()>, feature_count>;

/// One quality with its predicted frame time and error. Costs and errors of the features are added.
struct PredictedQuality {
    Quality quality{};
    double ms = 0.0;
    double error = 0.0;
};

/// Returns the Pareto front of all qualities in time and error, from the fastest to the most exact. `base_ms`
/// is the time of a frame with all `features` at `fast`. Features that are not listed stay balanced. The
/// front is built feature by feature and loses no optimum: G. Nemhauser, Z. Ullmann, "Discrete Dynamic
/// Programming and Capital Allocation", 1969.
std::vector<PredictedQuality> pareto_front(const FeatureCosts &table,
                                           std::span<const QualityFeature> features, double base_ms);

/// Returns the index of the quality with the least error within `budget_ms`, or 0 (the fastest) if none fits.
std::size_t choose(const std::vector<PredictedQuality> &front, double budget_ms);

/// Holds a frame time. It decides once per window of frames, by their median. If the median exceeds the
/// budget, it steps down to what the corrected prediction allows, at least one step. It steps up only if the
/// better quality is predicted well inside the budget for several windows in a row. Each step up that must be
/// undone doubles that wait, so that the quality does not oscillate.
class FrameGovernor {
  public:
    static constexpr std::size_t window_frames = 20;
    static constexpr int first_wait_windows = 3;
    static constexpr int max_wait_windows = 1 << 20;

    /// `front` must not be empty; it is sorted from the fastest to the most exact.
    FrameGovernor(std::vector<PredictedQuality> front, double budget_ms);

    const PredictedQuality &current() const { return front_[index_]; }
    double budget_ms() const { return budget_ms_; }
    int changes() const { return changes_; }
    /// True if even the fastest quality exceeds the budget, by the last measurement.
    bool out_of_reach() const;
    /// Takes the time of a finished frame. Returns true if the quality changes with the next frame.
    bool observe(double frame_ms);

  private:
    bool move_to(std::size_t index);

    std::vector<PredictedQuality> front_;
    double budget_ms_;
    std::size_t index_;
    double scale_ = 1.0; // measured over predicted time
    std::vector<double> window_;
    int fast_windows_ = 0; // windows in a row in which a better quality would have fitted
    int wait_windows_ = first_wait_windows;
    bool stepped_up_ = false; // the last change was a step up
    int changes_ = 0;
};

} // namespace paradize
