#pragma once
// --fps during playback: calibrates, holds the frame rate and reports it.

#include "app/calibration.hpp"
#include "app/frame_rate.hpp"
#include "app/report.hpp"

#include <filesystem>
#include <span>
#include <vector>

namespace paradize {

class RateControl {
  public:
    /// Calibrates from second `elapsed_s` on, chooses the first quality and logs both. All data must be
    /// resident. `folder`: of the scene. Leaves the renderer with other settings than before.
    RateControl(double fps, Renderer &renderer, const assets::SceneFile &file,
                std::span<const QualityFeature> features, const Device &device, double elapsed_s,
                const std::filesystem::path &folder);

    /// The quality to draw with.
    const Quality &quality() const { return governor_.current().quality; }
    /// Takes the time of a finished frame. Returns true if the quality changes with the next frame.
    bool observe(double ms);
    /// `frame_ms`: all frames, for as long as none has been drawn in the present quality.
    FrameRate report(const std::vector<double> &frame_ms) const;

  private:
    const double fps_;
    const Calibration calibration_;
    FrameGovernor governor_;
    std::vector<double> recent_ms_; // since the last change of quality
};

} // namespace paradize
