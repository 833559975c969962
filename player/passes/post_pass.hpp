#pragma once
// From linear light to the screen: exposure, one tone map, one sRGB encode, a still dither.

#include "gl/program.hpp"
#include "passes/pass.hpp"

namespace paradize {

class PostPass : public Pass {
  public:
    explicit PostPass(const PassSetup &setup);
    void finish(Frame &frame) override;

  private:
    gl::Program program_;
};

} // namespace paradize
