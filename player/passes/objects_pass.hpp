#pragma once
// Palm, jetty and whatever else the scene places: bump and parallax mapped, with gloss, translucent leaves.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/pass.hpp"
#include "passes/surroundings.hpp"

namespace paradize {

class ObjectsPass : public Pass {
  public:
    explicit ObjectsPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    void draw_depth(const Frame &frame);

    gl::Program depth_;
    gl::Program program_;
    Surroundings surroundings_;
    gl::Sampler sampler_;
    int depth_model_at_ = -1, depth_cutoff_at_ = -1;
    int model_at_ = -1, scale_at_ = -1, maps_at_ = -1, base_color_at_ = -1, parallax_at_ = -1, shine_at_ = -1,
        cutoff_at_ = -1;
    int translucency_at_ = -1, multisampled_at_ = -1;
};

} // namespace paradize
