#include "streaming/texture_format.hpp"

#include "error.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <vector>

namespace paradize {

namespace {

using assets::PixelFormat;

/// `format` 0 means block-compressed.
struct Format {
    GLenum internal = 0;
    GLenum format = 0;
    GLenum type = 0;
};

Format gl_format(PixelFormat format) {
    switch (format) {
    case PixelFormat::r8_unorm:
        return {GL_R8, GL_RED, GL_UNSIGNED_BYTE};
    case PixelFormat::rg8_unorm:
        return {GL_RG8, GL_RG, GL_UNSIGNED_BYTE};
    case PixelFormat::rg8_snorm:
        return {GL_RG8_SNORM, GL_RG, GL_BYTE};
    case PixelFormat::rgba8_unorm:
        return {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE};
    case PixelFormat::rgba8_srgb:
        return {GL_SRGB8_ALPHA8, GL_RGBA, GL_UNSIGNED_BYTE};
    case PixelFormat::r16_unorm:
        return {GL_R16, GL_RED, GL_UNSIGNED_SHORT};
    case PixelFormat::rg16_unorm:
        return {GL_RG16, GL_RG, GL_UNSIGNED_SHORT};
    case PixelFormat::rg16_snorm:
        return {GL_RG16_SNORM, GL_RG, GL_SHORT};
    case PixelFormat::rgba16_float:
        return {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT};
    case PixelFormat::r32_float:
        return {GL_R32F, GL_RED, GL_FLOAT};
    case PixelFormat::bc1_rgb_unorm:
        return {GL_COMPRESSED_RGB_S3TC_DXT1_EXT, 0, 0};
    case PixelFormat::bc1_rgb_srgb:
        return {GL_COMPRESSED_SRGB_S3TC_DXT1_EXT, 0, 0};
    case PixelFormat::bc3_unorm:
        return {GL_COMPRESSED_RGBA_S3TC_DXT5_EXT, 0, 0};
    case PixelFormat::bc3_srgb:
        return {GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT, 0, 0};
    case PixelFormat::bc4_unorm:
        return {GL_COMPRESSED_RED_RGTC1, 0, 0};
    case PixelFormat::bc5_unorm:
        return {GL_COMPRESSED_RG_RGTC2, 0, 0};
    case PixelFormat::bc5_snorm:
        return {GL_COMPRESSED_SIGNED_RG_RGTC2, 0, 0};
    case PixelFormat::bc7_unorm:
        return {GL_COMPRESSED_RGBA_BPTC_UNORM_ARB, 0, 0};
    case PixelFormat::bc7_srgb:
        return {GL_COMPRESSED_SRGB_ALPHA_BPTC_UNORM_ARB, 0, 0};
    }
    return {};
}

bool needs_s3tc(PixelFormat format) {
    return format == PixelFormat::bc1_rgb_unorm || format == PixelFormat::bc1_rgb_srgb ||
           format == PixelFormat::bc3_unorm || format == PixelFormat::bc3_srgb;
}

bool needs_bptc(PixelFormat format) {
    return format == PixelFormat::bc7_unorm || format == PixelFormat::bc7_srgb;
}

GLenum target_of(const assets::Ktx2 &ktx) {
    return ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
}

GLenum image_target(const assets::Ktx2 &ktx, std::uint32_t face) {
    return ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP_POSITIVE_X + face : GL_TEXTURE_2D;
}

void set_parameters(GLenum target, GLint levels) {
    const GLint wrap = target == GL_TEXTURE_2D ? GL_REPEAT : GL_CLAMP_TO_EDGE;
    glTexParameteri(target, GL_TEXTURE_WRAP_S, wrap);
    glTexParameteri(target, GL_TEXTURE_WRAP_T, wrap);
    glTexParameteri(target, GL_TEXTURE_WRAP_R, wrap);
    glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(target, GL_TEXTURE_BASE_LEVEL, levels - 1);
    glTexParameteri(target, GL_TEXTURE_MAX_LEVEL, levels - 1);
}

void allocate_level(const assets::Ktx2 &ktx, const Format &format, std::uint32_t file_level, GLint level) {
    const assets::Ktx2Level &size = ktx.levels[file_level];
    const auto width = static_cast<GLsizei>(size.width_px);
    const auto height = static_cast<GLsizei>(size.height_px);
    for (std::uint32_t face = 0; face < ktx.faces; ++face) {
        if (format.format == 0) {
            glCompressedTexImage2D(image_target(ktx, face), level, format.internal, width, height, 0,
                                   static_cast<GLsizei>(size.bytes.size() / ktx.faces), nullptr);
        } else {
            glTexImage2D(image_target(ktx, face), level, static_cast<GLint>(format.internal), width, height,
                         0, format.format, format.type, nullptr);
        }
    }
}

} // namespace

Storage best_storage() {
    return epoxy_has_gl_extension("GL_ARB_texture_storage") ? Storage::immutable : Storage::mutable_levels;
}

void check_support(const assets::Ktx2 &ktx, const std::string &file) {
    if (needs_s3tc(ktx.format) &&
        !(epoxy_has_gl_extension("GL_EXT_texture_compression_s3tc") &&
          (epoxy_has_gl_extension("GL_EXT_texture_sRGB") || epoxy_gl_version() >= 40))) {
        throw Error(
            file + ": this driver does not support BC1 and BC3 textures; bake the scene with RGBA8 textures");
    }
    if (needs_bptc(ktx.format) &&
        !(epoxy_has_gl_extension("GL_ARB_texture_compression_bptc") || epoxy_gl_version() >= 42)) {
        throw Error(file +
                    ": this driver does not support BC7 textures (GL_ARB_texture_compression_bptc); bake the "
                    "scene at another tier than exact");
    }
    GLint most = 0;
    glGetIntegerv(ktx.faces == 6 ? GL_MAX_CUBE_MAP_TEXTURE_SIZE : GL_MAX_TEXTURE_SIZE, &most);
    if (static_cast<GLint>(std::max(ktx.levels[0].width_px, ktx.levels[0].height_px)) > most) {
        throw Error(file + ": " + std::to_string(ktx.levels[0].width_px) + " x " +
                    std::to_string(ktx.levels[0].height_px) + " texels, the driver's limit is " +
                    std::to_string(most));
    }
}

gl::Texture allocate_texture(const assets::Ktx2 &ktx, std::uint32_t first_level, Storage storage) {
    const Format format = gl_format(ktx.format);
    const GLenum target = target_of(ktx);
    const auto levels = static_cast<GLint>(ktx.levels.size() - first_level);
    const assets::Ktx2Level &finest = ktx.levels[first_level];
    gl::Texture texture = gl::Texture::create();
    glBindTexture(target, texture.name());
    set_parameters(target, levels);
    if (storage == Storage::immutable) {
        glTexStorage2D(target, levels, format.internal, static_cast<GLsizei>(finest.width_px),
                       static_cast<GLsizei>(finest.height_px));
    } else {
        for (GLint level = 0; level < levels; ++level) {
            allocate_level(ktx, format, first_level + static_cast<std::uint32_t>(level), level);
        }
    }
    return texture;
}

void make_sampled(const assets::Ktx2 &ktx, LevelsFrom levels, std::uint32_t finest,
                  std::optional<int> max_level) {
    const auto room_from = static_cast<GLint>(levels.first_level);
    const auto first = static_cast<GLint>(finest);
    const auto last = static_cast<GLint>(ktx.levels.size()) - 1;
    const GLint coarsest = first != 0 && max_level ? std::clamp(*max_level, first, last) : last;
    glBindTexture(target_of(ktx), levels.texture.name());
    glTexParameteri(target_of(ktx), GL_TEXTURE_BASE_LEVEL, first - room_from);
    glTexParameteri(target_of(ktx), GL_TEXTURE_MAX_LEVEL, coarsest - room_from);
}

void copy_levels(const assets::Ktx2 &ktx, LevelsFrom from, LevelsFrom to) {
    if (!epoxy_has_gl_extension("GL_ARB_copy_image") && epoxy_gl_version() < 43) {
        copy_levels_by_memory(ktx, from, to);
        return;
    }
    const GLenum target = target_of(ktx);
    for (std::uint32_t i = std::max(from.first_level, to.first_level); i < ktx.levels.size(); ++i) {
        const assets::Ktx2Level &level = ktx.levels[i];
        glCopyImageSubData(from.texture.name(), target, static_cast<GLint>(i - from.first_level), 0, 0, 0,
                           to.texture.name(), target, static_cast<GLint>(i - to.first_level), 0, 0, 0,
                           static_cast<GLsizei>(level.width_px), static_cast<GLsizei>(level.height_px),
                           static_cast<GLsizei>(ktx.faces));
    }
}

void copy_levels_by_memory(const assets::Ktx2 &ktx, LevelsFrom from, LevelsFrom to) {
    const std::uint32_t first = std::max(from.first_level, to.first_level);
    std::vector<std::byte> held;
    read_levels(ktx, from, first, held);
    write_levels(ktx, to, first, held);
}

void read_levels(const assets::Ktx2 &ktx, LevelsFrom from, std::uint32_t first, std::vector<std::byte> &out) {
    const Format format = gl_format(ktx.format);
    std::size_t size = 0;
    for (std::uint32_t i = first; i < ktx.levels.size(); ++i) {
        size += ktx.levels[i].bytes.size();
    }
    out.resize(size);
    std::byte *to = out.data();
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glBindTexture(target_of(ktx), from.texture.name());
    for (std::uint32_t i = first; i < ktx.levels.size(); ++i) {
        const auto level = static_cast<GLint>(i - from.first_level);
        for (std::uint32_t face = 0; face < ktx.faces; ++face) {
            if (format.format == 0) {
                glGetCompressedTexImage(image_target(ktx, face), level, to);
            } else {
                glGetTexImage(image_target(ktx, face), level, format.format, format.type, to);
            }
            to += ktx.levels[i].bytes.size() / ktx.faces;
        }
    }
}

void write_levels(const assets::Ktx2 &ktx, LevelsFrom to, std::uint32_t first,
                  std::span<const std::byte> bytes) {
    for (std::uint32_t i = first; i < ktx.levels.size(); ++i) {
        for (std::uint32_t face = 0; face < ktx.faces; ++face) {
            assets::UploadChunk chunk;
            chunk.level = i;
            chunk.part = face;
            chunk.rows = ktx.levels[i].height_px;
            chunk.bytes = bytes.first(ktx.levels[i].bytes.size() / ktx.faces);
            upload_rows(to, ktx, chunk, {chunk.bytes.data()});
            bytes = bytes.subspan(chunk.bytes.size());
        }
    }
}

gl::Texture neutral_texture(const assets::Ktx2 &ktx) {
    std::array<float, 4> texel{0.5F, 0.5F, 0.5F, 1.0F};
    switch (ktx.format) {
    case PixelFormat::rg8_snorm:
    case PixelFormat::bc5_snorm:
    case PixelFormat::rg8_unorm:
    case PixelFormat::bc5_unorm:
    case PixelFormat::rg16_unorm:
    case PixelFormat::rg16_snorm:
        texel = {0.0F, 0.0F, 0.0F, 1.0F};
        break;
    default:
        break;
    }
    const GLenum target = target_of(ktx);
    gl::Texture texture = gl::Texture::create();
    glBindTexture(target, texture.name());
    set_parameters(target, 1);
    for (std::uint32_t face = 0; face < ktx.faces; ++face) {
        glTexImage2D(image_target(ktx, face), 0, GL_RGBA16F, 1, 1, 0, GL_RGBA, GL_FLOAT, texel.data());
    }
    return texture;
}

void upload_rows(LevelsFrom to, const assets::Ktx2 &ktx, const assets::UploadChunk &chunk,
                 const gl::Source &from) {
    const Format format = gl_format(ktx.format);
    const auto level = static_cast<GLint>(chunk.level - to.first_level);
    const auto width = static_cast<GLsizei>(ktx.levels[chunk.level].width_px);
    const auto row = static_cast<GLint>(chunk.offset);
    const auto rows = static_cast<GLsizei>(chunk.rows);
    const GLenum image = image_target(ktx, chunk.part);
    const void *const bytes = from.buffer == 0 ? from.bytes : reinterpret_cast<const void *>(from.offset);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, from.buffer);
    glBindTexture(target_of(ktx), to.texture.name());
    if (format.format == 0) {
        glCompressedTexSubImage2D(image, level, 0, row, width, rows, format.internal,
                                  static_cast<GLsizei>(chunk.bytes.size()), bytes);
    } else {
        glTexSubImage2D(image, level, 0, row, width, rows, format.format, format.type, bytes);
    }
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

} // namespace paradize
