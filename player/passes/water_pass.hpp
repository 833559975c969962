#pragma once
// Draws the sea: reflection and refraction distorted by waves, absorption by depth, sun glitter and foam.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "passes/sea_grid.hpp"
#include "scene/near_waves.hpp"
#include "scene/ripples.hpp"

#include <optional>

namespace paradize {

class WaterPass : public Pass {
  public:
    explicit WaterPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    enum Unit : unsigned { unit_reflection, unit_refraction, unit_wave_shares };
    /// The program, with point lights or without them, for an eye above the water or in it.
    struct Lit {
        Lit(const PassSetup &setup, bool point_lights, bool in_water);

        gl::Program program;
        EnvironmentBindings environment;
        int half_size, has_textures, distortion, deep, shallow, shine, wave_length, fade_distance;
        int center, near_waves, share_of_xz, light_set, lamplit, rings, ripple_state;
    };

    void apply_waves(const Frame &frame, const View &view, const Lit &lit) const;

    Lit lit_;
    std::optional<Lit> by_lights_; // where point lights reach the water
    Lit from_below_;
    gl::Sampler clamped_;
    SeaGrid grid_;
    WaveShares shares_;     // with waves near the eye
    gl::Texture share_map_; // of shares_
};

} // namespace paradize
