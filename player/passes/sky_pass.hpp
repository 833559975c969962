#pragma once
// Draws the sky, which fades into haze towards the horizon: a cube map, or in a scene with a time of day the
// skies of two of its keys with sun, moon, stars and clouds.

#include "gl/program.hpp"
#include "passes/daytime_sky.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"

#include <memory>

namespace paradize {

class SkyPass : public Pass {
  public:
    explicit SkyPass(const PassSetup &setup);
    ~SkyPass() override;
    void draw(const Frame &frame, const View &view) override;

  private:
    struct Drawing;
    std::unique_ptr<Drawing> standing_, by_day_, by_night_; // the scene needs the first, or the others
};

} // namespace paradize
