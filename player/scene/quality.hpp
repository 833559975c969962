#pragma once
// Quality features and tiers, and the render settings that they select.

#include "assets/scene/file.hpp"

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace paradize {

enum class Tier : unsigned char { fast, balanced, exact };
inline constexpr std::array<std::string_view, 3> tier_names{"fast", "balanced", "exact"};

/// The features that --quality names. Texture formats are not among them: the bake's tiers choose them.
enum class QualityFeature : unsigned char {
    shadow,
    reflection,
    refraction,
    parallax,
    anisotropy,
    lod,
    resolution
};
inline constexpr std::array<std::string_view, 7> feature_names{
    "shadow", "reflection", "refraction", "parallax", "anisotropy", "lod", "resolution"};
inline constexpr std::size_t feature_count = feature_names.size();

/// One tier per feature. `balanced` means the scene's own settings.
using Quality = std::array<Tier, feature_count>;
constexpr Quality all_at(Tier tier) {
    Quality out{};
    out.fill(tier);
    return out;
}

/// Filter of shadow map lookups. The numbers are the values of SHADOW_FILTER in shaders/lib/shadow.glsl.
enum class ShadowFilter { hard = 0, disc = 1, penumbra = 2, nearest = 3 };

/// Settings that the passes are built and drawn with.
struct RenderSettings {
    float render_scale =
        1.0F; // sides of the drawn picture relative to the shown one, which it is enlarged to
    int shadow_size_px = 2048; // of each cascade
    int shadow_cascades = 3;   // scene/cascades.hpp; 1: the whole square alone
    ShadowFilter shadow_filter = ShadowFilter::disc;
    // The light turns, and what sways or moves throws its shadow, in steps: at half a degree a second one is
    // a twentieth of a degree, which moves the shadow of a thing 10 m above the ground by less than 1 cm.
    double shadow_steps_per_s = 10.0;
    bool sky_light = true; // light from all around differs with the direction; needs lookups of the sky
    int shaft_steps = 12;  // places that a ray through the air looks the shadow map up at; 0: no light shafts
    float reflection_scale = 1.0F; // relative to the drawn picture's size
    float refraction_scale = 1.0F;
    // 0: off; 1, 2: iterative; more: steps of the ray march (PARALLAX_STEPS of lib/parallax.glsl)
    int parallax_steps = 2;
    float anisotropy = 1.0F;
    float lod_error_px = 1.0F; // of the drawn picture; 0: always the finest level
    // alpha is looked up at four places of a pixel, and samples are resolved after a tone map
    bool fine_edges = true;
    bool near_waves = false;      // waves lift the sea near the eye
    bool vertex_lighting = true;  // of materials that ask for it (assets::Material::vertex_lit)
    int samples = 4;              // multisampling; 0: off
    bool late_depth_test = false; // where pixels have samples: gl::LateDepthTest
    float mip_bias = 0.0F;        // mip levels added when maps are sampled by distance
    float footprint = 1.0F;       // edge length of the area that one shaded sample represents, in pixels

    bool operator==(const RenderSettings &) const = default;
};

/// Properties of the graphics device.
struct Device {
    /// A CPU rasteriser. Anisotropic filtering is off then at every tier: llvmpipe (Mesa 22.3) visits the
    /// footprint texel by texel and hangs on some frames even at 2 x.
    bool software = false;
    int max_texture_px = 16384;
};

/// True if the feature changes the picture of this scene on this device.
bool has_feature(const assets::SceneFile &file, QualityFeature feature, const Device &device);

RenderSettings render_settings(const assets::SceneFile &file, const Quality &quality, const Device &device);
/// Settings of the frames that --reference averages: no tier's approximations.
RenderSettings reference_settings(const assets::SceneFile &file, int frames, const Device &device);

/// Returns the quality in the syntax of --quality: `shadow=fast, lod=exact ...`.
std::string to_text(const Quality &quality);

} // namespace paradize
