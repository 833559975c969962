#pragma once
// Measures what each quality feature costs on this machine, and looks up its error.

#include "app/frame_rate.hpp"
#include "assets/tradeoff_file.hpp"
#include "render/renderer.hpp"

#include <span>
#include <vector>

namespace paradize {

struct Calibration {
    FeatureCosts table{};
    double base_ms = 0.0; // of a frame with every feature at `fast`
};

/// Times a few frames for each feature at each tier, with all other features balanced, from several positions
/// of the flight. All data must be resident. `elapsed_s` stays the playback time. `errors` replace the
/// built-in errors of the features and tiers that they name. Leaves the renderer with other settings than
/// before.
Calibration calibrate(Renderer &renderer, const assets::SceneFile &file,
                      std::span<const QualityFeature> features, const Device &device, double elapsed_s,
                      std::span<const assets::FeatureError> errors);

} // namespace paradize
