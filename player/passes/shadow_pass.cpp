#include "passes/shadow_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace paradize {

namespace {

/// FNV-1a over 64-bit words (G. Fowler, L. Noll, K.-P. Vo, 1991).
void mix(std::uint64_t &hash, std::uint64_t word) {
    hash = (hash ^ word) * 1099511628211ULL;
}

// The shadows of what sways or moves go in steps. A light that turns in steps, as many a second
// (scene/daylight.cpp), has every cascade drawn anew: they share its steps. Otherwise each cascade has its
// own, so that few frames draw more than one, and none begins with a frame of 1/30 s, where rounding would
// decide.
/// Returns the second whose wind a cascade shows.
double wind_second(double elapsed_s, double steps_per_s, std::size_t cascade, std::size_t cascades,
                   bool light_turns) {
    const double ahead =
        light_turns ? 0.0 : (static_cast<double>(cascade) + 0.5) / static_cast<double>(cascades);
    return (std::floor(elapsed_s * steps_per_s + ahead) - ahead) / steps_per_s;
}

std::uint64_t fingerprint(const Frame &frame, const View &light, double wind_s) {
    std::uint64_t hash = 14695981039346656037ULL;
    const float *matrix = glm::value_ptr(light.view_projection);
    for (int i = 0; i < 16; ++i) {
        mix(hash, std::bit_cast<std::uint32_t>(matrix[i]));
    }
    for (const DrawItem &item : frame.visible(ViewKind::light)) {
        if (item.object->file->reach_m > 0.0F || item.object->moves()) { // with time alone
            mix(hash, std::bit_cast<std::uint64_t>(wind_s));
        }
        mix(hash, std::bit_cast<std::uintptr_t>(item.object));
        mix(hash, item.first);
        mix(hash, item.count);
        mix(hash, static_cast<std::uint64_t>(item.lod));
        for (const Material &material : item.object->materials) {
            if (const StreamedTexture *color = material.maps[assets::ObjectMap::color];
                color != nullptr && material.values.alpha_mode != assets::AlphaMode::opaque) {
                mix(hash, static_cast<std::uint64_t>(color->finest()));
            }
        }
    }
    if (const TerrainTiles *terrain = frame.terrain()) {
        for (const std::uint32_t patch : terrain->cut().patches()) {
            if (terrain->sees(light, no_plane, patch)) {
                mix(hash, std::uint64_t{patch} + 1);
            }
        }
    }
    return hash | 1U;
}

} // namespace

ShadowPass::ShadowPass(const PassSetup &setup)
    : maps_(gl::make_depth_comparison_layers(setup.settings.shadow_size_px, setup.settings.shadow_cascades)),
      cascades_(static_cast<std::size_t>(setup.settings.shadow_cascades)) {
    for (std::size_t i = 0; i < cascades_.size(); ++i) {
        cascades_[i].framebuffer = gl::make_layer_framebuffer(maps_, static_cast<int>(i));
    }
}

void ShadowPass::prepare(Frame &frame) {
    if (!frame.daylight.shines()) {
        return;
    }
    const assets::Shadow &shadow = *frame.scene.file().shadow;
    const View &light = frame.view(ViewKind::light);
    const bool light_turns = !frame.scene.file().daytime.empty();
    for (std::size_t i = 0; i < cascades_.size(); ++i) {
        Cascade &cascade = cascades_[i];
        const View view = cascade_view(shadow, light, frame.view(ViewKind::main), static_cast<int>(i));
        frame.shared.shadow_cascades[i] = cascade_fit(shadow, light, view);
        if (i > 0) {
            frame.cull_casters(view);
        }
        const double wind_s = wind_second(frame.clock.elapsed_s, frame.settings.shadow_steps_per_s, i,
                                          cascades_.size(), light_turns);
        const std::uint64_t now = fingerprint(frame, view, wind_s);
        if (now != cascade.drawn_fingerprint) {
            const bool moves = std::ranges::any_of(frame.visible(ViewKind::light),
                                                   [](const DrawItem &item) { return item.object->moves(); });
            if (moves) {
                frame.move_to(wind_s);
            }
            frame.draw_view(view, cascade.framebuffer.name(), true, wind_s);
            if (moves) {
                frame.move_to(frame.clock.elapsed_s);
            }
            cascade.drawn_fingerprint = now;
        }
    }
    frame.shared.shadow_map = &maps_;
}

} // namespace paradize
