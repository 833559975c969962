#pragma once
// The sea: reflection and refraction shaken by the waves, coloured by its depth, glittering in the sun.

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
    int half_size_at_ = -1, has_textures_at_ = -1, distortion_at_ = -1, deep_at_ = -1, shallow_at_ = -1,
        shine_at_ = -1;
    int wave_length_at_ = -1, fade_distance_at_ = -1, swash_at_ = -1;
};

} // namespace paradize
