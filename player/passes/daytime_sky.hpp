#pragma once
// Binds the inputs of programs that draw the sky between two keys of the scene
// (shaders/lib/daytime_sky.glsl).

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/frame.hpp"

namespace paradize {

class DaytimeSkyBindings {
  public:
    explicit DaytimeSkyBindings(const gl::Program &program);

    /// Call with the program in use.
    void apply(const Scene &scene, const Daylight &daylight) const;

  private:
    enum Unit : int { unit_before, unit_after, unit_clouds };
    gl::Sampler clouds_sampler_; // repeats across only
    int share_location_, turns_location_, fit_location_, ambient_location_, direction_location_,
        radiance_location_;
};

} // namespace paradize
