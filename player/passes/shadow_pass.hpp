#pragma once
// The sun's shadow map: depth from the light. Nothing that casts a shadow moves, so it is drawn again
// only when what it would show has changed: another level of detail, data that has just arrived.

#include "gl/handle.hpp"
#include "passes/pass.hpp"

#include <cstdint>

namespace paradize {

class ShadowPass : public Pass {
  public:
    explicit ShadowPass(const PassSetup &setup);
    void prepare(Frame &frame) override;

  private:
    gl::Texture map_; // depth, compared on lookup: 1 is lit
    gl::Framebuffer framebuffer_;
    int size_px_ = 0;
    std::uint64_t drawn_fingerprint_ = 0; // fingerprint of what the map shows; 0: nothing yet
};

} // namespace paradize
