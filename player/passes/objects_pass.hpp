#pragma once
// Palm, jetty and whatever else the scene places: bump and parallax mapped, with gloss, translucent leaves.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "gl/texture.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "streaming/scene.hpp"

#include <optional>
#include <vector>

namespace paradize {

class ObjectsPass : public Pass {
  public:
    explicit ObjectsPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    void draw_depth(const Frame &frame, const View &light);

    gl::Program depth_;
    gl::Program program_;
    EnvironmentBindings environment_;
    /// How one object's maps are read: the names of samplers.
    const assets::PerMap<unsigned> &samplers_of(const Frame &frame, const Object &object) const;
    unsigned sampler(gl::Wrap wrap, std::optional<int> max_level, const RenderSettings &settings);

    struct CachedSampler {
        gl::Wrap wrap;
        std::optional<int> max_level;
        gl::Sampler sampler;
    };
    std::vector<CachedSampler> samplers_;
    std::vector<assets::PerMap<unsigned>> object_samplers_; // by object, in the scene's order
    assets::PerMap<int> has_at_;                            // uniforms
    int depth_model_at_ = -1, depth_cutoff_at_ = -1;
    int model_at_ = -1, scale_at_ = -1, base_color_at_ = -1, parallax_at_ = -1, shine_at_ = -1,
        cutoff_at_ = -1;
    int translucency_at_ = -1, multisampled_at_ = -1;
};

} // namespace paradize
