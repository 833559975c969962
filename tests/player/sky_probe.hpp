#pragma once
// The shader of a sky that changes with the time of day, over a patch of directions.

#include "gl/frame_uniforms.hpp"
#include "gl/handle.hpp"
#include "shader_probe.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <string>
#include <vector>

namespace paradize::test {

/// Sets what a shader with lib/daytime_sky.glsl needs: a clear sky of two keys, without clouds and light.
struct DaytimeSky {
    gl::Texture before, after, clouds;
    float share = 0.0F;
    glm::vec4 turns{1.0F, 0.0F, 1.0F, 0.0F};
    glm::vec4 clouds_fit{0.0F};
    glm::vec3 cloud_ambient{0.0F};
    glm::vec3 light_direction{0.0F, 1.0F, 0.0F}, light_radiance{0.0F};

    explicit DaytimeSky(const glm::vec3 &radiance);
    void apply(ShaderProbe &probe) const;
};

/// A picture of directions, drawn by a shader of the sky.
class SkyPatch {
  public:
    /// fragment: sky.frag or daytime_sky.frag, the latter with NIGHT 1.
    explicit SkyPatch(const std::string &fragment);

    static constexpr int side_px = 64;
    gl::FrameUniforms frame = plain_frame(side_px);
    gl::Texture cube = float_cube(2, [](const glm::vec3 &) { return glm::vec3(1.0F); }); // of sky.frag
    DaytimeSky day{glm::vec3(0.0F)};
    glm::vec3 sun{0.0F, 1.0F, 0.0F}, moon{0.0F, 1.0F, 0.0F};
    glm::vec4 sun_disc{0.0F, 0.0F, 0.0F, 0.01F}, moon_disc{0.0F, 0.0F, 0.0F, 0.01F}; // radiance; radius, rad
    float star_light = 0.0F, star_area = 1.0F;
    glm::vec3 water_glow{0.0F};

    /// Colours around a direction, pixels_per_rad apart, the first row at the bottom.
    std::vector<glm::dvec3> around(const glm::vec3 &middle, double pixels_per_rad);
    glm::dvec3 in(const glm::vec3 &direction);

  private:
    ShaderProbe probe_;
};

} // namespace paradize::test
