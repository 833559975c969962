#pragma once
// Draws all objects: normal and parallax mapped, with gloss and translucent leaves.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "gl/texture.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "streaming/scene.hpp"

#include <optional>
#include <span>
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
    /// Sampler names of one object's maps, by material.
    std::span<const assets::PerMap<unsigned>> samplers_of(const Frame &frame, const Object &object) const;
    unsigned sampler(gl::Wrap wrap, std::optional<int> max_level, const RenderSettings &settings);

    struct CachedSampler {
        gl::Wrap wrap;
        std::optional<int> max_level;
        gl::Sampler sampler;
    };
    std::vector<CachedSampler> samplers_;
    std::vector<std::vector<assets::PerMap<unsigned>>> samplers_of_; // by object, then material
    assets::PerMap<int> has_map_locations_;                          // of the uniforms u_has_NAME
    int depth_model_location_ = -1, depth_cutoff_location_ = -1;
    int model_location_ = -1, base_color_location_ = -1, parallax_location_ = -1, shine_location_ = -1,
        cutoff_location_ = -1;
    int translucency_location_ = -1, multisampled_location_ = -1;
};

} // namespace paradize
