#pragma once
// Textures that are drawn into, samplers, and the bind of a texture with its sampler.

#include "gl/handle.hpp"

#include <optional>
#include <span>

namespace paradize::gl {

/// A texture without mips to draw into and to sample afterwards: clamped, linear filter.
/// `internal_format` is sized: GL_RGBA16F, GL_RGBA8, GL_DEPTH_COMPONENT24, GL_RG16F ...
Texture make_target(unsigned internal_format, int width_px, int height_px);

/// A depth texture for shadow lookups through sampler2DShadow (GL_COMPARE_REF_TO_TEXTURE, GL_LEQUAL), linear
/// filter.
Texture make_depth_comparison_target(int size_px);

Renderbuffer make_renderbuffer(unsigned internal_format, int width_px, int height_px, int samples);

/// How a texture is read. Parameters of samplers win over those of textures.
enum class Wrap { repeat, clamp };
enum class Filter { nearest, linear, mipmapped };
/// `anisotropy` is clamped to what the device offers; 1 is none. `max_level`: no coarser mip is read, however
/// small the picture of the texture; none: all are. `mip_bias`: levels added to the one that the footprint
/// asks for; below 0 is finer.
Sampler make_sampler(Wrap wrap, Filter filter, float anisotropy = 1.0F, std::optional<int> max_level = {},
                     float mip_bias = 0.0F);

/// Replaces a colour target by RGBA floats, rows from the bottom.
void write_target(const Texture &target, int width_px, int height_px, std::span<const float> pixels);

/// Binds a texture and optionally a sampler (0: the texture's own parameters) to a texture unit.
void bind_texture(unsigned unit, unsigned target, unsigned texture, unsigned sampler = 0);

} // namespace paradize::gl
