#pragma once
// Speed against accuracy: what can be drawn faster or finer, and what the passes draw with.

#include "assets/scene_file.hpp"

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace paradize {

enum class Tier : unsigned char { fast, balanced, exact };
inline constexpr std::array<std::string_view, 3> tier_names{"fast", "balanced", "exact"};

/// What --quality names. How textures are stored is no trade of the player's: the bake's tiers decide it.
enum class QualityFeature : unsigned char { shadow, reflection, refraction, parallax, anisotropy, lod };
inline constexpr std::array<std::string_view, 6> feature_names{"shadow",   "reflection", "refraction",
                                                               "parallax", "anisotropy", "lod"};
inline constexpr std::size_t feature_count = feature_names.size();

/// A tier for each trade. `balanced` is what the scene asks for.
using Quality = std::array<Tier, feature_count>;
constexpr Quality all_at(Tier tier) {
    Quality out{};
    out.fill(tier);
    return out;
}

/// How the shadow map is looked up; the numbers are SHADOW_FILTER of shaders/lib/shadow.glsl.
enum class ShadowFilter { hard = 0, disc = 1, penumbra = 2, nearest = 3 };

/// What the passes draw with.
struct RenderSettings {
    int shadow_size_px = 2048;
    ShadowFilter shadow_filter = ShadowFilter::disc;
    float reflection_scale = 1.0F; // of the picture's size
    float refraction_scale = 1.0F;
    int parallax_steps = 2; // 0: none; more than 2: the ray is followed (PARALLAX_STEPS of lib/parallax.glsl)
    float anisotropy = 1.0F;
    float lod_error_px = 1.0F; // 0: the finest that there is
    int samples = 4;           // of a pixel's edges; 0: its middle alone
    float mip_bias = 0.0F;     // levels, added where maps are sampled by distance
    float footprint = 1.0F;    // edge of what one shading stands for, pixels

    bool operator==(const RenderSettings &) const = default;
};

/// What the device is and can.
struct Device {
    /// Rasterised on the CPU: anisotropic filtering is off at every tier. llvmpipe (Mesa 22.3), which walks
    /// over the ellipse texel by texel, does not come back from some frames, even with 2 x.
    bool software = false;
    int max_texture_px = 16384;
};

/// Does the trade change anything of this scene on this device?
bool has_feature(const assets::SceneFile &file, QualityFeature feature, const Device &device);

RenderSettings render_settings(const assets::SceneFile &file, const Quality &quality, const Device &device);
/// Of one of the frames that --reference averages: no approximation that a tier has.
RenderSettings reference_settings(const assets::SceneFile &file, int frames, const Device &device);

/// As --quality takes it: `shadow=fast, lod=exact ...`.
std::string to_text(const Quality &quality);

} // namespace paradize
