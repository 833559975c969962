// The list of passes, in drawing order: the views that others sample, then opaque things, the sky behind
// them, the water that shows both, the sparkles, and the step to the screen.

#include "passes/objects_pass.hpp"
#include "passes/particles_pass.hpp"
#include "passes/pass.hpp"
#include "passes/post_pass.hpp"
#include "passes/shadow_pass.hpp"
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
    bool (*wanted)(const SceneFile &file);
    std::unique_ptr<Pass> (*make)(const PassSetup &setup);
};

template <class P>
std::unique_ptr<Pass> make(const PassSetup &setup) {
    return std::make_unique<P>(setup);
}

constexpr std::array<Entry, 9> entries{{
    {"shadow", [](const SceneFile &f) { return f.shadow.has_value(); }, make<ShadowPass>},
    {"reflection", [](const SceneFile &f) { return f.water && f.reflection_scale; }, make<ReflectionPass>},
    {"refraction", [](const SceneFile &f) { return f.water && f.refraction_scale; }, make<RefractionPass>},
    {"terrain", [](const SceneFile &f) { return f.terrain.has_value(); }, make<TerrainPass>},
    {"objects", [](const SceneFile &f) { return !f.objects.empty(); }, make<ObjectsPass>},
    {"sky", [](const SceneFile &f) { return !f.sky.empty(); }, make<SkyPass>},
    {"water", [](const SceneFile &f) { return f.water.has_value(); }, make<WaterPass>},
    {"particles", [](const SceneFile &f) { return !f.particles.empty(); }, make<ParticlesPass>},
    {"post", [](const SceneFile &) { return true; }, make<PostPass>},
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

std::vector<std::unique_ptr<Pass>> make_passes(const PassSetup &setup,
                                               std::span<const std::string> disabled) {
    const auto left_out = [&](std::string_view name) {
        return std::ranges::find(disabled, name) != disabled.end();
    };
    std::vector<std::unique_ptr<Pass>> passes;
    for (const Entry &entry : entries) {
        // Without the water nobody looks at what it would show.
        const bool unseen = left_out("water") && (entry.name == "reflection" || entry.name == "refraction");
        if (entry.wanted(setup.scene.file()) && !left_out(entry.name) && !unseen) {
            passes.push_back(entry.make(setup));
        }
    }
    return passes;
}

} // namespace paradize
