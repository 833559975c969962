#pragma once
// Framebuffers over textures or multisampled renderbuffers. They do not own what is attached.

#include "gl/handle.hpp"

namespace paradize::gl {

/// A framebuffer over 2D textures; either may be empty (depth only: no draw buffer). Throws Error when
/// incomplete.
Framebuffer make_framebuffer(const Texture &color, const Texture &depth);
/// A framebuffer over renderbuffers (multisampled).
Framebuffer make_framebuffer(const Renderbuffer &color, const Renderbuffer &depth);

/// Binds for drawing and sets the viewport to the whole of it. Name 0 is the window.
void bind_framebuffer(unsigned framebuffer, int width_px, int height_px);

/// Copies or resolves colour; both have the same size unless both have one sample.
void blit_color(unsigned from, int from_width_px, int from_height_px, unsigned to, int to_width_px,
                int to_height_px);

/// Copies or resolves depth: of each pixel one of its samples. Both have the same size and the same format.
void blit_depth(unsigned from, unsigned to, int width_px, int height_px);

} // namespace paradize::gl
