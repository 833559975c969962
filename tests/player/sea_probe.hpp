#pragma once
// The sea's shader over a line of places on calm water, with a sky of any radiance.

#include "gl/frame_uniforms.hpp"
#include "gl/handle.hpp"
#include "shader_probe.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <initializer_list>
#include <optional>
#include <string_view>
#include <vector>

namespace paradize::test {

/// A lamp over the sea.
struct SeaLamp {
    glm::vec3 place_m;
    glm::vec3 light; // of a surface one metre away that faces it
    float radius_m = 1e-3F;
};

/// Calm water at y = 0. Without more it is black below, mirrors no picture, and has no sun.
class SeaProbe {
  public:
    /// defines: of water.frag, as "IN_WATER 1".
    explicit SeaProbe(std::initializer_list<std::string_view> defines = {});

    gl::FrameUniforms frame;
    gl::Texture sky = one_sky(glm::vec3(1.0F)), reflection = one_color(0, 0, 0, 1),
                refraction = one_color(0, 0, 0, 1);
    bool has_reflection = false, has_refraction = false;
    glm::vec3 deep{0.0F}, shallow{0.0F};
    glm::vec3 water_glow{0.0F};
    float scatter_per_m = 0.0F;
    float wave_length_m = 1e9F; // so long that none is smaller than a pixel
    float fade_distance_m = 1e9F;
    float smoothness = 1.0F;
    float sky_blur = 1.0F;
    glm::vec2 lean{0.0F};  // horizontal part of each layer's normal, x and z
    glm::vec2 shake{0.0F}; // du/dv of each layer, along x and z
    float specular = 1.0F;
    bool in_shade = false;
    std::vector<SeaLamp> lamps;

    static constexpr int places = 64;
    /// Radiance and opacity at the places between `first` and `last`, at the middle of equal parts of the
    /// line.
    std::vector<glm::dvec4> between(const glm::vec2 &first, const glm::vec2 &last);
    /// At one place.
    glm::dvec4 at(const glm::vec2 &xz) { return between(xz, xz)[0]; }

    /// Radiance that sky.frag draws in a direction, with this sky and haze.
    glm::dvec3 drawn_sky(const glm::vec3 &direction);

    static gl::Texture one_sky(const glm::vec3 &radiance);

  private:
    ShaderProbe probe_;
    std::optional<ShaderProbe> sky_probe_; // made when it is needed
    gl::Texture no_shadow_;
    gl::Buffer lights_;
};

/// Reflectance of calm water for unpolarised light: A. Fresnel, 1823. cosine: of the angle in air.
double fresnel_of_water(double cosine);

constexpr double water_index = 1.33;

} // namespace paradize::test
