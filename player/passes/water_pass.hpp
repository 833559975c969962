#pragma once
// Draws the sea: reflection and refraction distorted by waves, absorption by depth, sun glitter and foam.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"

namespace paradize {

class WaterPass : public Pass {
  public:
    explicit WaterPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    gl::Program program_;
    EnvironmentBindings environment_;
    gl::Sampler clamped_;
    gl::VertexArray grid_;
    gl::Buffer vertices_, indices_;
    int index_count_ = 0;
    int half_size_location_ = -1, has_textures_location_ = -1, distortion_location_ = -1, deep_location_ = -1,
        shallow_location_ = -1, shine_location_ = -1;
    int wave_length_location_ = -1, fade_distance_location_ = -1, swash_location_ = -1;
};

} // namespace paradize
