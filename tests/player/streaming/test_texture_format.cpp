#include "assets/ktx2.hpp"
#include "assets/upload_plan.hpp"
#include "context.hpp"
#include "files.hpp"
#include "streaming/texture_format.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

using namespace paradize;

TEST_CASE("textures: mutable storage holds the same texels as immutable storage") {
    if (!test::have_context()) {
        return;
    }
    for (const assets::PixelFormat format :
         {assets::PixelFormat::bc5_snorm, assets::PixelFormat::rg8_snorm, assets::PixelFormat::r16_unorm,
          assets::PixelFormat::bc4_unorm, assets::PixelFormat::rg16_snorm, assets::PixelFormat::rg16_unorm,
          assets::PixelFormat::bc7_srgb}) {
        const test::Bytes bytes = test::ktx2_file(format, 16, 8);
        const assets::Ktx2 ktx = test::read_ktx2(bytes, "a.ktx2");
        const assets::UploadPlan plan = plan_texture(ktx);
        std::array<std::vector<float>, 2> texels;
        for (const Storage storage : {Storage::immutable, Storage::mutable_levels}) {
            const gl::Texture texture = allocate_texture(ktx, 0, storage);
            for (const assets::UploadChunk &chunk : plan.chunks) {
                upload_rows({texture, 0}, ktx, chunk, {chunk.bytes.data()});
            }
            std::vector<float> &out = texels[storage == Storage::immutable ? 0 : 1];
            out.resize(8 * 4 * 2);
            glGetTexImage(GL_TEXTURE_2D, 1, GL_RG, GL_FLOAT, out.data());
        }
        CHECK(texels[0] == texels[1]);
        CHECK(texels[0][0] != texels[0][2 * 5]); // the texels are not empty
    }
    test::throw_on_error();
}

TEST_CASE("textures: until it is loaded a map of directions points nowhere, and others are grey") {
    if (!test::have_context()) {
        return;
    }
    for (const auto &[format, value] : {std::pair(assets::PixelFormat::rg8_snorm, 0.0F),
                                        {assets::PixelFormat::bc5_snorm, 0.0F},
                                        {assets::PixelFormat::rg16_snorm, 0.0F},
                                        {assets::PixelFormat::rgba8_srgb, 0.5F}}) {
        const test::Bytes bytes = test::ktx2_file(format, 4, 4);
        const gl::Texture texture = neutral_texture(test::read_ktx2(bytes, "a.ktx2"));
        std::array<float, 2> texel{-1.0F, -1.0F};
        glGetTexImage(GL_TEXTURE_2D, 0, GL_RG, GL_FLOAT, texel.data());
        CHECK(texel == std::array{value, value});
    }
    test::throw_on_error();
}

TEST_CASE("textures: colours of every format are decoded from sRGB, and what is no colour is not") {
    if (!test::have_context()) {
        return;
    }
    for (const auto &[format, srgb] : {std::pair(assets::PixelFormat::rgba8_srgb, true),
                                       {assets::PixelFormat::bc1_rgb_srgb, true},
                                       {assets::PixelFormat::bc3_srgb, true},
                                       {assets::PixelFormat::bc7_srgb, true},
                                       {assets::PixelFormat::rgba8_unorm, false},
                                       {assets::PixelFormat::bc1_rgb_unorm, false},
                                       {assets::PixelFormat::bc3_unorm, false},
                                       {assets::PixelFormat::bc7_unorm, false}}) {
        const test::Bytes bytes = test::ktx2_file(format, 4, 4);
        const gl::Texture texture = allocate_texture(test::read_ktx2(bytes, "a.ktx2"), 0, best_storage());
        GLint internal = 0;
        glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
        const bool decodes = internal == GL_SRGB8_ALPHA8 || internal == GL_COMPRESSED_SRGB_S3TC_DXT1_EXT ||
                             internal == GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT ||
                             internal == GL_COMPRESSED_SRGB_ALPHA_BPTC_UNORM_ARB;
        CHECK(decodes == srgb);
    }
    test::throw_on_error();
}

TEST_CASE("textures: levels are copied between textures of other sizes, on the device and through memory") {
    if (!test::have_context()) {
        return;
    }
    for (const auto &[format, faces] :
         {std::pair(assets::PixelFormat::rgba8_unorm, 1U), std::pair(assets::PixelFormat::bc3_srgb, 1U),
          std::pair(assets::PixelFormat::rgba16_float, 6U), std::pair(assets::PixelFormat::bc5_snorm, 1U)}) {
        const test::Bytes bytes = test::ktx2_file(format, 32, 32, faces);
        const assets::Ktx2 ktx = test::read_ktx2(bytes, "a.ktx2");
        const assets::UploadPlan plan = plan_texture(ktx);
        const unsigned target = faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        const unsigned image = faces == 6 ? GL_TEXTURE_CUBE_MAP_POSITIVE_Y : GL_TEXTURE_2D;
        const gl::Texture whole = allocate_texture(ktx, 0, best_storage());
        for (const assets::UploadChunk &chunk : plan.chunks) {
            upload_rows({whole, 0}, ktx, chunk, {chunk.bytes.data()});
        }
        for (const auto copy : {copy_levels, copy_levels_by_memory}) {
            const gl::Texture coarse = allocate_texture(ktx, 2, best_storage()); // from 8 x 8 on
            copy(ktx, {whole, 0}, {coarse, 2});
            const gl::Texture finer = allocate_texture(ktx, 1, best_storage());
            copy(ktx, {coarse, 2}, {finer, 1});
            for (const auto &[texture, level] : {std::pair(&coarse, 1), std::pair(&finer, 2)}) { // 4 x 4
                std::vector<std::uint16_t> expected(4 * 4 * 4), found(4 * 4 * 4); // halves: NaN is equal
                glBindTexture(target, whole.name());
                glGetTexImage(image, 3, GL_RGBA, GL_HALF_FLOAT, expected.data());
                glBindTexture(target, texture->name());
                glGetTexImage(image, level, GL_RGBA, GL_HALF_FLOAT, found.data());
                CHECK(found == expected);
            }
        }
    }
    test::throw_on_error();
}

TEST_CASE(
    "textures: the coarsest level to sample stays the same level of the file while finer ones are missing") {
    if (!test::have_context()) {
        return;
    }
    const test::Bytes bytes = test::ktx2_file(assets::PixelFormat::rgba8_unorm, 32, 32); // six levels
    const assets::Ktx2 ktx = test::read_ktx2(bytes, "a.ktx2");
    const auto coarsest = [&](std::uint32_t first_level, std::optional<int> max_level) {
        const gl::Texture texture = allocate_texture(ktx, first_level, best_storage());
        make_sampled(ktx, {texture, first_level}, first_level, max_level);
        GLint last = 0;
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &last);
        // So it is in a texture that has room for finer levels.
        const gl::Texture roomy = allocate_texture(ktx, 0, best_storage());
        make_sampled(ktx, {roomy, 0}, first_level, max_level);
        GLint first = -1;
        GLint also_last = -1;
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, &first);
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &also_last);
        CHECK(first == static_cast<GLint>(first_level));
        CHECK(also_last == last + first);
        return last + static_cast<GLint>(first_level);
    };
    CHECK(coarsest(0, 3) == 5); // whole textures are limited by their samplers
    CHECK(coarsest(1, 3) == 3);
    CHECK(coarsest(2, 3) == 3);
    CHECK(coarsest(4, 3) == 4); // nothing finer is there
    CHECK(coarsest(2, 31) == 5);
    CHECK(coarsest(2, std::nullopt) == 5);
    test::throw_on_error();
}
