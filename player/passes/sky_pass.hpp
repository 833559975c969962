#pragma once
// Draws the sky: a cube map that fades into haze towards the horizon.

#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"

namespace paradize {

class SkyPass : public Pass {
  public:
    explicit SkyPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    gl::Program program_;
    EnvironmentBindings environment_;
};

} // namespace paradize
