#pragma once
// Framebuffers with textures or multisampled renderbuffers. They do not own their attachments.

#include "gl/handle.hpp"

namespace paradize::gl {

/// Creates a framebuffer with 2D textures. Either may be empty; without colour there is no draw buffer.
/// Throws Error if it is incomplete.
Framebuffer make_framebuffer(const Texture &color, const Texture &depth);
/// Creates a framebuffer that draws into one layer of an array of depth textures.
Framebuffer make_layer_framebuffer(const Texture &depth_layers, int layer);
/// Creates a framebuffer with renderbuffers, which may be multisampled: colour, and depth with stencil.
Framebuffer make_framebuffer(const Renderbuffer &color, const Renderbuffer &depth);

/// Creates a framebuffer with a multisampled texture and a renderbuffer of as many samples, depth with
/// stencil.
Framebuffer make_multisample_framebuffer(const Texture &samples, const Renderbuffer &depth);

/// Binds the framebuffer for drawing and sets the viewport to its whole size. Name 0 is the window.
void bind_framebuffer(unsigned framebuffer, int width_px, int height_px);

/// Copies or resolves the colour. The sizes must be equal unless both have one sample.
void blit_color(unsigned from, int from_width_px, int from_height_px, unsigned to, int to_width_px,
                int to_height_px);

/// Copies six squares beside each other into the finest level of the faces of a cube map, +X -X +Y -Y +Z -Z.
void copy_faces(unsigned from, const Texture &cube, int edge_px);

/// Copies or resolves depth: of each pixel one of its samples. Both have the same size and the same format.
void blit_depth(unsigned from, unsigned to, int width_px, int height_px);

} // namespace paradize::gl
