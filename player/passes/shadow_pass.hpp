#pragma once
// Draws the sun's shadow map. Casters do not move, so the map is redrawn only when its content changes:
// another level of detail, or data that has just become resident.

#include "gl/handle.hpp"
#include "passes/pass.hpp"

#include <cstdint>

namespace paradize {

class ShadowPass : public Pass {
  public:
    explicit ShadowPass(const PassSetup &setup);
    void prepare(Frame &frame) override;

  private:
    gl::Texture map_; // depth, compared on lookup; 1 is lit
    gl::Framebuffer framebuffer_;
    int size_px_ = 0;
    std::uint64_t drawn_fingerprint_ = 0; // of what the map shows; 0: nothing yet
};

} // namespace paradize
