#include "passes/shadow_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"

#include <glm/gtc/type_ptr.hpp>

#include <bit>

namespace paradize {

namespace {

/// FNV-1a over 64-bit words (G. Fowler, L. Noll, K.-P. Vo, 1991).
void mix(std::uint64_t &hash, std::uint64_t word) {
    hash = (hash ^ word) * 1099511628211ULL;
}

std::uint64_t fingerprint(const Frame &frame, const View &light) {
    std::uint64_t hash = 14695981039346656037ULL;
    const float *matrix = glm::value_ptr(light.view_projection);
    for (int i = 0; i < 16; ++i) {
        mix(hash, std::bit_cast<std::uint32_t>(matrix[i]));
    }
    for (const DrawItem &item : frame.visible(ViewKind::light)) {
        mix(hash, std::bit_cast<std::uintptr_t>(item.object));
        mix(hash, item.first);
        mix(hash, item.count);
        mix(hash, static_cast<std::uint64_t>(item.lod));
        for (const Material &material : item.object->materials) {
            const StreamedTexture *color = material.maps[assets::ObjectMap::color];
            mix(hash, color != nullptr && color->complete() ? 1U : 0U);
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
    : map_(gl::make_depth_comparison_target(setup.settings.shadow_size_px)),
      framebuffer_(gl::make_framebuffer({}, map_)), size_px_(setup.settings.shadow_size_px) {}

void ShadowPass::prepare(Frame &frame) {
    View light = frame.view(ViewKind::light);
    light.width_px = size_px_;
    light.height_px = size_px_;
    const std::uint64_t now = fingerprint(frame, light);
    if (now != drawn_fingerprint_) {
        frame.draw_view(light, framebuffer_.name(), true);
        drawn_fingerprint_ = now;
    }
    frame.shared.shadow_map = &map_;
}

} // namespace paradize
