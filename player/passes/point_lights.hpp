#pragma once
// The lights of a frame, for the passes that draw what they reach.

#include "assets/scene/file.hpp"
#include "gl/handle.hpp"
#include "gl/light_uniforms.hpp"
#include "scene/point_lights.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize {

class PointLights {
  public:
    /// `file` must outlive this object. Allocates all memory.
    explicit PointLights(const assets::SceneFile &file);

    /// Finds the strengths at a moment, and uploads the sets whose lights are on.
    void update(const Moment &moment, const glm::dvec3 &anchor);

    /// By light set: the set that it is drawn as, by a program for point lights. 0: no light of it is on, and
    /// nothing glows. Sets that glow alike without a light are one.
    std::span<const std::uint32_t> lit() const { return lit_; }
    bool any_lit() const { return any_lit_; }
    /// True if a light is on.
    bool any_shines() const { return any_shines_; }
    /// By light: its share of its full strength, 0 to 1.
    std::span<const float> strengths() const { return strengths_; }
    /// Binds the uniform block of a set that is lit.
    void bind(std::uint32_t set) const;

  private:
    const assets::SceneFile &file_;
    std::vector<float> strengths_;
    std::vector<std::uint32_t> lit_;
    bool any_lit_ = false, any_shines_ = false;
    gl::Buffer uniforms_; // gl::LightUniforms by set
    std::size_t set_bytes_ = 0;
    std::vector<std::byte> written_, next_;
};

/// Returns the define of programs that include lib/light.glsl: whether they draw point lights.
std::string point_lights_define(bool on);

} // namespace paradize
