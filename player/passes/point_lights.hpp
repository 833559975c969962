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

    /// Finds the strengths at a moment, and uploads the sets if one is lit and a light has changed.
    void update(const Moment &moment, const glm::dvec3 &anchor);

    /// By light set: 1 if a light of it is on or it glows, so that a program for point lights draws it.
    std::span<const std::uint8_t> lit() const { return lit_; }
    bool any_lit() const { return any_lit_; }
    /// True if a light is on.
    bool any_shines() const { return any_shines_; }
    /// By light: its share of its full strength, 0 to 1.
    std::span<const float> strengths() const { return strengths_; }
    /// Binds a uniform block: the first one has the first light_sets_per_block() sets, the next one those
    /// that follow.
    void bind_block(std::uint32_t block) const;
    /// Binds the block of a set. Returns the set's place in it, which shaders call light_set.
    int bind(std::uint32_t set) const;

  private:
    const assets::SceneFile &file_;
    std::vector<float> strengths_;
    std::vector<std::uint8_t> lit_;
    bool any_lit_ = false, any_shines_ = false;
    glm::dvec3 anchor_; // of sets_
    std::uint32_t sets_per_block_;
    std::size_t block_bytes_ = 0;
    std::vector<std::byte> blocks_; // gl::LightUniforms of each set
    gl::Buffer uniforms_;           // the same
};

/// Returns how many sets a uniform block of this device holds: at least 31, of 16 KiB.
std::uint32_t light_sets_per_block();

/// Returns the defines of programs that include lib/light.glsl: whether they draw point lights, and the sets
/// of a block.
std::string point_lights_define(bool on);

} // namespace paradize
