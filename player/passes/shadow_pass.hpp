#pragma once
// Draws the cascades of the shadow map of sun and moon. A cascade is redrawn only when its content changes:
// it has moved, a level of detail is another, data has just become resident, or what sways or moves took a
// step.

#include "gl/handle.hpp"
#include "passes/pass.hpp"

#include <cstdint>
#include <vector>

namespace paradize {

class ShadowPass : public Pass {
  public:
    explicit ShadowPass(const PassSetup &setup);
    void prepare(Frame &frame) override;

  private:
    struct Cascade {
        gl::Framebuffer framebuffer;
        std::uint64_t drawn_fingerprint = 0; // of what its layer shows; 0: nothing yet
    };

    gl::Texture maps_; // depth, a layer per cascade, compared on lookup; 1 is lit
    std::vector<Cascade> cascades_;
};

} // namespace paradize
