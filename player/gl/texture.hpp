#pragma once
// Render target textures and samplers.

#include "gl/handle.hpp"

#include <optional>
#include <span>

namespace paradize::gl {

/// Creates a render target without mips: clamped, linear filter (depth: nearest). `internal_format` is a
/// sized format: GL_RGBA16F, GL_RGBA8, GL_DEPTH_COMPONENT24, GL_RG16F and so on.
Texture make_target(unsigned internal_format, int width_px, int height_px);

/// Creates a multisampled render target for sampler2DMS. The driver may give more samples than asked for.
Texture make_multisample_target(unsigned internal_format, int width_px, int height_px, int samples);

/// Creates an array of depth textures for sampler2DArrayShadow: GL_COMPARE_REF_TO_TEXTURE, GL_LEQUAL, linear
/// filter.
Texture make_depth_comparison_layers(int size_px, int layers);

/// Creates a cube map of half or full floats with all its mips, trilinear. `size_px` is a power of two.
Texture make_cube_target(unsigned internal_format, int size_px);
/// Computes the mips of a cube map from its finest level.
void make_cube_mips(const Texture &cube);

Renderbuffer make_renderbuffer(unsigned internal_format, int width_px, int height_px, int samples);

/// Sampler settings. They override the settings of a texture.
enum class Wrap { repeat, clamp, mirror };
enum class Filter { nearest, linear, mipmapped };
/// How a sampler continues beyond the edges, along u and v.
struct Wraps {
    Wrap across = Wrap::repeat, down = Wrap::repeat;
    bool operator==(const Wraps &) const = default;
};
/// `nearest`: what is enlarged shows its texels as squares. `anisotropy` is clamped to the device's limit; 1
/// is off. `max_level` is the coarsest mip to sample; without it all mips are sampled. `mip_bias` is added to
/// the mip level; negative values are sharper.
Sampler make_sampler(Wraps wraps, Filter filter, float anisotropy = 1.0F, std::optional<int> max_level = {},
                     float mip_bias = 0.0F, bool nearest = false);
Sampler make_sampler(Wrap both, Filter filter, float anisotropy = 1.0F, std::optional<int> max_level = {},
                     float mip_bias = 0.0F);

/// Fills a colour target with RGBA floats, first row at the bottom.
void write_target(const Texture &target, int width_px, int height_px, std::span<const float> pixels);

/// Binds a texture to a texture unit, optionally with a sampler. Sampler 0 uses the texture's own settings.
void bind_texture(unsigned unit, unsigned target, unsigned texture, unsigned sampler = 0);

} // namespace paradize::gl
