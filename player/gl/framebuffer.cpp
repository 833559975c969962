#include "gl/framebuffer.hpp"

#include "error.hpp"

#include <epoxy/gl.h>

#include <cstdio>

namespace paradize::gl {

namespace {

void check_complete() {
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        char code[16];
        std::snprintf(code, sizeof code, "0x%04x", status);
        throw Error(std::string("the graphics driver rejects a render target (status ") + code +
                    "); update the driver or use a smaller --size");
    }
}

} // namespace

Framebuffer make_framebuffer(const Texture &color, const Texture &depth) {
    Framebuffer framebuffer = Framebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    if (color) {
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.name(), 0);
    } else {
        glDrawBuffer(GL_NONE);
        glReadBuffer(GL_NONE);
    }
    if (depth) {
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
    }
    check_complete();
    return framebuffer;
}

Framebuffer make_layer_framebuffer(const Texture &depth_layers, int layer) {
    Framebuffer framebuffer = Framebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth_layers.name(), 0, layer);
    check_complete();
    return framebuffer;
}

Framebuffer make_framebuffer(const Renderbuffer &color, const Renderbuffer &depth) {
    Framebuffer framebuffer = Framebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color.name());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth.name());
    check_complete();
    return framebuffer;
}

Framebuffer make_multisample_framebuffer(const Texture &samples, const Renderbuffer &depth) {
    Framebuffer framebuffer = Framebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D_MULTISAMPLE, samples.name(),
                           0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth.name());
    check_complete();
    return framebuffer;
}

void bind_framebuffer(unsigned framebuffer, int width_px, int height_px) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width_px, height_px);
}

void blit_color(unsigned from, int from_width_px, int from_height_px, unsigned to, int to_width_px,
                int to_height_px) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to);
    const bool same = from_width_px == to_width_px && from_height_px == to_height_px;
    glBlitFramebuffer(0, 0, from_width_px, from_height_px, 0, 0, to_width_px, to_height_px,
                      GL_COLOR_BUFFER_BIT, same ? GL_NEAREST : GL_LINEAR);
}

void copy_faces(unsigned from, const Texture &cube, int edge_px) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_CUBE_MAP, cube.name());
    for (int face = 0; face < 6; ++face) {
        glCopyTexSubImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + static_cast<unsigned>(face), 0, 0, 0,
                            face * edge_px, 0, edge_px, edge_px);
    }
}

void blit_depth(unsigned from, unsigned to, int width_px, int height_px) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to);
    glBlitFramebuffer(0, 0, width_px, height_px, 0, 0, width_px, height_px, GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

} // namespace paradize::gl
