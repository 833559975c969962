#include "gl/texture.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace paradize::gl {

namespace {

/// Returns the format and type that glTexImage2D accepts with this internal format when there is no data.
void transfer_format(unsigned internal_format, GLenum &format, GLenum &type) {
    type = GL_FLOAT;
    switch (internal_format) {
    case GL_DEPTH_COMPONENT16:
    case GL_DEPTH_COMPONENT24:
    case GL_DEPTH_COMPONENT32F:
        format = GL_DEPTH_COMPONENT;
        break;
    case GL_DEPTH24_STENCIL8:
        format = GL_DEPTH_STENCIL;
        type = GL_UNSIGNED_INT_24_8;
        break;
    case GL_R8:
    case GL_R16F:
    case GL_R32F:
        format = GL_RED;
        break;
    case GL_RG8:
    case GL_RG16F:
    case GL_RG32F:
        format = GL_RG;
        break;
    default:
        format = GL_RGBA;
        break;
    }
}

/// Sets what the texture that is bound to `target` reads: one level, clamped.
void set_sampling(GLenum target, GLint filter) {
    glTexParameteri(target, GL_TEXTURE_MAX_LEVEL, 0);
    glTexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

GLint edge_of(Wrap wrap) {
    if (wrap == Wrap::repeat) {
        return GL_REPEAT;
    }
    return wrap == Wrap::clamp ? GL_CLAMP_TO_EDGE : GL_MIRRORED_REPEAT;
}

} // namespace

Texture make_target(unsigned internal_format, int width_px, int height_px) {
    const bool depth = internal_format == GL_DEPTH_COMPONENT16 || internal_format == GL_DEPTH_COMPONENT24 ||
                       internal_format == GL_DEPTH_COMPONENT32F || internal_format == GL_DEPTH24_STENCIL8;
    Texture texture = Texture::create();
    GLenum format = 0;
    GLenum type = 0;
    transfer_format(internal_format, format, type);
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(internal_format), width_px, height_px, 0, format, type,
                 nullptr);
    // Depth is not filtered: the mean of neighbouring depths has no meaning.
    set_sampling(GL_TEXTURE_2D, depth ? GL_NEAREST : GL_LINEAR);
    return texture;
}

Texture make_multisample_target(unsigned internal_format, int width_px, int height_px, int samples) {
    Texture texture = Texture::create();
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, texture.name());
    // Fixed places of the samples: a framebuffer that also has a renderbuffer requires them.
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, samples, internal_format, width_px, height_px,
                            GL_TRUE);
    return texture;
}

Texture make_depth_comparison_layers(int size_px, int layers) {
    Texture texture = Texture::create();
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT24, size_px, size_px, layers, 0,
                 GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
    set_sampling(GL_TEXTURE_2D_ARRAY, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    return texture;
}

Texture make_cube_target(unsigned internal_format, int size_px) {
    Texture texture = Texture::create();
    glBindTexture(GL_TEXTURE_CUBE_MAP, texture.name());
    GLint level = 0;
    for (int edge_px = size_px; edge_px > 0; edge_px /= 2, ++level) {
        for (unsigned face = 0; face < 6; ++face) {
            glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, level, static_cast<GLint>(internal_format),
                         edge_px, edge_px, 0, GL_RGBA, GL_FLOAT, nullptr);
        }
    }
    set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, level - 1);
    glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    return texture;
}

void make_cube_mips(const Texture &cube) {
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_CUBE_MAP, cube.name());
    glGenerateMipmap(GL_TEXTURE_CUBE_MAP);
}

Renderbuffer make_renderbuffer(unsigned internal_format, int width_px, int height_px, int samples) {
    Renderbuffer buffer = Renderbuffer::create();
    glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, internal_format, width_px, height_px);
    return buffer;
}

Sampler make_sampler(Wrap both, Filter filter, float anisotropy, std::optional<int> max_level,
                     float mip_bias) {
    return make_sampler(Wraps{both, both}, filter, anisotropy, max_level, mip_bias);
}

Sampler make_sampler(Wraps wraps, Filter filter, float anisotropy, std::optional<int> max_level,
                     float mip_bias, bool nearest) {
    Sampler sampler = Sampler::create();
    const unsigned name = sampler.name();
    glSamplerParameteri(name, GL_TEXTURE_WRAP_S, edge_of(wraps.across));
    glSamplerParameteri(name, GL_TEXTURE_WRAP_T, edge_of(wraps.down));
    GLint smaller = GL_LINEAR_MIPMAP_LINEAR;
    if (filter != Filter::mipmapped) {
        smaller = filter == Filter::nearest ? GL_NEAREST : GL_LINEAR;
    }
    glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, smaller);
    const bool squares = nearest || filter == Filter::nearest;
    glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, squares ? GL_NEAREST : GL_LINEAR);
    if (anisotropy > 1.0F && (epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic") ||
                              epoxy_has_gl_extension("GL_ARB_texture_filter_anisotropic"))) {
        float limit = 1.0F;
        glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY_EXT, &limit);
        glSamplerParameterf(name, GL_TEXTURE_MAX_ANISOTROPY_EXT, std::min(anisotropy, limit));
    }
    if (max_level) {
        glSamplerParameterf(name, GL_TEXTURE_MAX_LOD, static_cast<float>(*max_level));
    }
    if (mip_bias != 0.0F) {
        glSamplerParameterf(name, GL_TEXTURE_LOD_BIAS, mip_bias);
    }
    return sampler;
}

void write_target(const Texture &target, int width_px, int height_px, std::span<const float> pixels) {
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, target.name());
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_px, height_px, GL_RGBA, GL_FLOAT, pixels.data());
}

void bind_texture(unsigned unit, unsigned target, unsigned texture, unsigned sampler) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(target, texture);
    glBindSampler(unit, sampler);
}

} // namespace paradize::gl
