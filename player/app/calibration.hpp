#pragma once
// What each trade costs on this machine, and what it errs.

#include "app/frame_rate.hpp"
#include "assets/tradeoff_file.hpp"
#include "render/renderer.hpp"

#include <span>
#include <vector>

namespace paradize {

struct Calibration {
    FeatureCosts table{};
    double base_ms = 0.0; // of a frame with every trade at `fast`
};

/// Draws a few frames of each trade at each tier, the others balanced, from several places of the flight,
/// each until the device has finished it; everything is resident. The show's clock stays at `elapsed_s`.
/// Leaves the renderer with another detail. `errors` that name a trade and a tier replace those that come
/// with the player.
Calibration calibrate(Renderer &renderer, const assets::SceneFile &file,
                      std::span<const QualityFeature> features, const Device &device, double elapsed_s,
                      std::span<const assets::FeatureError> errors);

} // namespace paradize
