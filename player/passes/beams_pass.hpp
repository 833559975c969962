#pragma once
// Beams of light into the sky, above the lights that have one.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"

#include <cstdint>
#include <vector>

namespace paradize {

class BeamsPass : public Pass {
  public:
    explicit BeamsPass(const PassSetup &setup);
    void update(Frame &frame) override;
    void draw(const Frame &frame, const View &view) override;

  private:
    gl::Program program_;
    EnvironmentBindings environment_;
    gl::VertexArray strips_;
    gl::Buffer instances_;
    std::vector<std::uint32_t> lights_; // those that have a beam
    std::vector<float> data_;           // seven floats for each
    std::size_t count_ = 0;             // beams that are on
};

} // namespace paradize
