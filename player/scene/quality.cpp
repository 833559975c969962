#include "scene/quality.hpp"

#include "scene/cascades.hpp"

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

constexpr int smallest_shadow_px = 64;
constexpr float fast_render_scale = 0.7F; // half the pixels
constexpr int shaft_steps = 12;
constexpr int exact_shaft_steps = 32;
constexpr int exact_parallax_steps = 24;
constexpr int reference_parallax_steps = 128;
constexpr float graphics_anisotropy = 4.0F;
constexpr float max_anisotropy = 16.0F;
constexpr float finest_mip_bias = -3.0F; // as for eight samples along a pixel's edge

template <typename T>
T pick(const Quality &quality, QualityFeature feature, T fast, T balanced, T exact) {
    const std::array<T, 3> values{fast, balanced, exact};
    return values[static_cast<std::size_t>(quality[static_cast<std::size_t>(feature)])];
}

bool has_relief(const assets::SceneFile &file) {
    return std::ranges::any_of(file.objects, [](const assets::Object &object) {
        return std::ranges::any_of(object.materials, [](const assets::Material &m) {
            return !m.maps[assets::ObjectMap::height].empty() && m.parallax_scale > 0.0F;
        });
    });
}

bool has_near_waves(const assets::SceneFile &file) {
    return file.water && file.water->wave_height_m > 0.0F;
}

} // namespace

bool has_feature(const assets::SceneFile &file, QualityFeature feature, const Device &device) {
    switch (feature) {
    case QualityFeature::shadow:
        return file.shadow.has_value();
    case QualityFeature::reflection:
        return file.water && file.reflection_scale;
    case QualityFeature::refraction:
        return file.water && file.refraction_scale;
    case QualityFeature::parallax:
        return has_relief(file);
    case QualityFeature::anisotropy:
        return !device.software && (file.terrain || !file.objects.empty());
    case QualityFeature::lod:
        return file.terrain || !file.objects.empty() || has_near_waves(file);
    case QualityFeature::resolution:
        return true;
    }
    return false;
}

RenderSettings render_settings(const assets::SceneFile &file, const Quality &quality, const Device &device) {
    RenderSettings out;
    const int size = file.shadow ? file.shadow->size_px : out.shadow_size_px;
    out.shadow_size_px =
        pick(quality, QualityFeature::shadow, std::max(size / 2, std::min(size, smallest_shadow_px)), size,
             std::max(size, std::min(2 * size, device.max_texture_px)));
    out.shadow_cascades = pick(quality, QualityFeature::shadow, 1, max_cascades, max_cascades);
    out.shadow_filter =
        pick(quality, QualityFeature::shadow, ShadowFilter::hard, ShadowFilter::disc, ShadowFilter::penumbra);
    out.shadow_steps_per_s *=
        pick(quality, QualityFeature::shadow, 0.5, 1.0, 1.0); // texels are twice as wide
    out.sky_light = pick(quality, QualityFeature::shadow, false, true, true);
    out.shaft_steps =
        file.light_shafts ? pick(quality, QualityFeature::shadow, 0, shaft_steps, exact_shaft_steps) : 0;
    const auto scale = [&](QualityFeature feature, std::optional<float> scene_scale) {
        const float balanced = scene_scale.value_or(1.0F);
        return pick(quality, feature, 0.5F * balanced, balanced, std::max(balanced, 1.0F));
    };
    out.reflection_scale = scale(QualityFeature::reflection, file.reflection_scale);
    out.refraction_scale = scale(QualityFeature::refraction, file.refraction_scale);
    out.parallax_steps = pick(quality, QualityFeature::parallax, 0, 2, exact_parallax_steps);
    if (!device.software) {
        out.anisotropy = pick(quality, QualityFeature::anisotropy, 1.0F, graphics_anisotropy, max_anisotropy);
    }
    out.lod_error_px = pick(quality, QualityFeature::lod, 3.0F * file.lod_error_px, file.lod_error_px,
                            0.25F * file.lod_error_px);
    out.near_waves = has_near_waves(file) && pick(quality, QualityFeature::lod, false, true, true);
    out.vertex_lighting = pick(quality, QualityFeature::lod, true, true, false);
    out.fine_edges = pick(quality, QualityFeature::lod, false, true, true);
    out.render_scale = pick(quality, QualityFeature::resolution, fast_render_scale, 1.0F, 1.0F);
    out.samples = pick(quality, QualityFeature::resolution, 0, out.samples, out.samples);
    out.late_depth_test = device.software;
    return out;
}

RenderSettings reference_settings(const assets::SceneFile &file, int frames, const Device &device) {
    RenderSettings out = render_settings(file, all_at(Tier::exact), device);
    out.shadow_filter = ShadowFilter::nearest;
    out.parallax_steps = reference_parallax_steps;
    out.lod_error_px = 0.0F;
    out.samples = 0;
    out.footprint = 1.0F / std::sqrt(static_cast<float>(frames));
    out.mip_bias = std::max(std::log2(out.footprint), finest_mip_bias);
    return out;
}

std::string to_text(const Quality &quality) {
    std::string out;
    for (std::size_t i = 0; i < feature_count; ++i) {
        out += (out.empty() ? "" : ", ") + std::string(feature_names[i]) + "=" +
               std::string(tier_names[static_cast<std::size_t>(quality[i])]);
    }
    return out;
}

} // namespace paradize
