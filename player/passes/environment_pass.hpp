#pragma once
// Draws the environment that surfaces reflect, where the light changes with the time of day: a small cube map
// of the sky, with mips.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/daytime_sky.hpp"
#include "passes/pass.hpp"

#include <cstdint>

namespace paradize {

class EnvironmentPass : public Pass {
  public:
    explicit EnvironmentPass(const PassSetup &setup);
    void prepare(Frame &frame) override;

  private:
    static constexpr int faces = 6;
    gl::Program program_;
    DaytimeSkyBindings bindings_;
    gl::Texture cube_;
    gl::Texture strip_; // the faces beside each other: one draw call draws them all
    gl::Framebuffer framebuffer_;
    int face_location_, pixels_location_;
    double drawn_s_ = -1.0;          // second that the cube shows
    std::uint64_t drawn_levels_ = 0; // of its inputs
};

} // namespace paradize
