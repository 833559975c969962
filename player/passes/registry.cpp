// The list of passes in drawing order: views that others sample, opaque surfaces, sky, water, blended
// surfaces, particles, and the conversion to the screen.

#include "passes/beams_pass.hpp"
#include "passes/environment_pass.hpp"
#include "passes/objects_pass.hpp"
#include "passes/particles_pass.hpp"
#include "passes/pass.hpp"
#include "passes/post_pass.hpp"
#include "passes/shadow_pass.hpp"
#include "passes/shafts_pass.hpp"
#include "passes/sky_pass.hpp"
#include "passes/terrain_pass.hpp"
#include "passes/water_pass.hpp"
#include "passes/water_views.hpp"

#include <algorithm>
#include <array>

namespace paradize {

namespace {

using assets::SceneFile;

struct Entry {
    std::string_view name;
    bool (*needed)(const SceneFile &file);
    bool (*reusable)(const RenderSettings &a, const RenderSettings &b);
    std::unique_ptr<Pass> (*make)(const PassSetup &setup);
};

template <class P>
std::unique_ptr<Pass> make(const PassSetup &setup) {
    return std::make_unique<P>(setup);
}

bool always(const RenderSettings & /*a*/, const RenderSettings & /*b*/) {
    return true;
}

bool same_light(const RenderSettings &a, const RenderSettings &b) {
    return a.shadow_filter == b.shadow_filter && a.sky_light == b.sky_light &&
           a.shadow_cascades == b.shadow_cascades && a.mip_bias == b.mip_bias;
}

bool same_surface(const RenderSettings &a, const RenderSettings &b) {
    return same_light(a, b) && a.anisotropy == b.anisotropy;
}

bool same_objects(const RenderSettings &a, const RenderSettings &b) {
    return same_surface(a, b) && a.parallax_steps == b.parallax_steps &&
           a.vertex_lighting == b.vertex_lighting && a.samples == b.samples && a.fine_edges == b.fine_edges;
}

bool has_beams(const SceneFile &file) {
    return std::ranges::any_of(file.lights,
                               [](const assets::PointLight &light) { return light.beam_m > 0.0F; });
}

bool has_blended(const SceneFile &file) {
    return std::ranges::any_of(file.objects, [](const assets::Object &object) {
        return std::ranges::any_of(object.materials, [](const assets::Material &material) {
            return material.alpha_mode == assets::AlphaMode::blend;
        });
    });
}

constexpr std::array<Entry, 13> entries{{
    {"environment", [](const SceneFile &f) { return !f.daytime.empty(); }, always, make<EnvironmentPass>},
    {"shadow", [](const SceneFile &f) { return f.shadow.has_value(); },
     [](const RenderSettings &a, const RenderSettings &b) {
         return a.shadow_size_px == b.shadow_size_px && a.shadow_cascades == b.shadow_cascades;
     },
     make<ShadowPass>},
    {"reflection", [](const SceneFile &f) { return f.water && f.reflection_scale; },
     [](const RenderSettings &a, const RenderSettings &b) {
         return a.reflection_scale == b.reflection_scale && a.samples == b.samples;
     },
     make<ReflectionPass>},
    {"refraction", [](const SceneFile &f) { return f.water && f.refraction_scale; },
     [](const RenderSettings &a, const RenderSettings &b) {
         return a.refraction_scale == b.refraction_scale;
     },
     make<RefractionPass>},
    {"terrain", [](const SceneFile &f) { return f.terrain.has_value(); }, same_surface, make<TerrainPass>},
    {"objects", [](const SceneFile &f) { return !f.objects.empty(); }, same_objects, make<ObjectsPass>},
    {"sky", [](const SceneFile &f) { return !f.sky.empty() || !f.daytime.empty(); }, always, make<SkyPass>},
    {"water", [](const SceneFile &f) { return f.water.has_value(); },
     [](const RenderSettings &a, const RenderSettings &b) {
         return same_light(a, b) && a.near_waves == b.near_waves;
     },
     make<WaterPass>},
    {"blended", has_blended, same_objects, make<BlendedPass>},
    {"beams", has_beams, always, make<BeamsPass>},
    {"particles", [](const SceneFile &f) { return !f.particles.empty(); }, always, make<ParticlesPass>},
    {"shafts", [](const SceneFile &f) { return f.light_shafts.has_value(); },
     [](const RenderSettings &a, const RenderSettings &b) { return a.shaft_steps == b.shaft_steps; },
     make<ShaftsPass>},
    {"post", [](const SceneFile &) { return true; },
     [](const RenderSettings &a, const RenderSettings &b) { return a.render_scale == b.render_scale; },
     make<PostPass>},
}};

constexpr auto names = [] {
    std::array<std::string_view, entries.size()> list;
    std::ranges::transform(entries, list.begin(), &Entry::name);
    return list;
}();

} // namespace

std::span<const std::string_view> pass_names() {
    return names;
}

std::vector<std::size_t> enabled_passes(const SceneFile &file, std::span<const std::string> disabled) {
    const auto is_disabled = [&](std::string_view name) {
        return std::ranges::find(disabled, name) != disabled.end();
    };
    std::vector<std::size_t> needed;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const Entry &entry = entries[i];
        // Only the water samples the first two. Shafts are shadows in the air. Blended materials are objects
        // too.
        const bool unused =
            (is_disabled("water") && (entry.name == "reflection" || entry.name == "refraction")) ||
            (is_disabled("objects") && entry.name == "blended") ||
            (is_disabled("shadow") && entry.name == "shafts");
        if (entry.needed(file) && !is_disabled(entry.name) && !unused) {
            needed.push_back(i);
        }
    }
    return needed;
}

std::unique_ptr<Pass> make_pass(std::size_t index, const PassSetup &setup) {
    return entries[index].make(setup);
}

bool reusable(std::size_t index, const RenderSettings &made_for, const RenderSettings &wanted) {
    return entries[index].reusable(made_for, wanted);
}

} // namespace paradize
