#include "assets/ktx2.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

using namespace paradize;
using assets::PixelFormat;

TEST_CASE("KTX2: every level of every format is found where the writer put it") {
    for (const PixelFormat format :
         {PixelFormat::r8_unorm, PixelFormat::rg8_snorm, PixelFormat::rgba8_srgb, PixelFormat::r16_unorm,
          PixelFormat::rgba16_float, PixelFormat::r32_float, PixelFormat::bc1_rgb_srgb, PixelFormat::bc3_srgb,
          PixelFormat::bc4_unorm, PixelFormat::bc5_snorm}) {
        const test::Bytes file = test::ktx2_file(format, 20, 8);
        const assets::Ktx2 ktx = assets::read_ktx2(file, "t.ktx2");
        REQUIRE(ktx.levels.size() == 5);
        CHECK(ktx.format == format);
        CHECK(ktx.levels[0].width_px == 20);
        CHECK(ktx.levels[4].height_px == 1);
        for (std::size_t i = 0; i < ktx.levels.size(); ++i) {
            CHECK(ktx.levels[i].bytes[0] == static_cast<std::byte>(i));
        }
    }
}

TEST_CASE("KTX2: a cube map has six faces in each level") {
    const test::Bytes file = test::ktx2_file(PixelFormat::rgba16_float, 4, 4, 6);
    const assets::Ktx2 ktx = assets::read_ktx2(file, "sky.ktx2");
    CHECK(ktx.faces == 6);
    CHECK(ktx.levels[0].bytes.size() == 4 * 4 * 8 * 6);
}

TEST_CASE("KTX2: a file cut anywhere is refused and never read beyond its end") {
    const test::Bytes file = test::ktx2_file(PixelFormat::bc1_rgb_srgb, 16, 16);
    for (std::size_t length = 0; length < file.size(); ++length) {
        const test::Bytes cut(file.begin(),
                              file.begin() + static_cast<std::ptrdiff_t>(length)); // ASan watches its end
        CHECK_THROWS_AS(assets::read_ktx2(cut, "cut.ktx2"), Error);
    }
}

TEST_CASE("KTX2: any byte of the header may be wrong without harm") {
    const test::Bytes file = test::ktx2_file(PixelFormat::rg8_snorm, 16, 8);
    for (std::size_t at = 0; at < 80 + 24 * 5; ++at) {
        for (const unsigned value : {0x00U, 0x01U, 0x7FU, 0xFFU}) {
            test::Bytes wrong = file;
            wrong[at] = static_cast<std::byte>(value);
            try {
                const assets::Ktx2 ktx = assets::read_ktx2(wrong, "wrong.ktx2");
                for (const assets::Ktx2Level &level : ktx.levels) {
                    CHECK(level.bytes.data() >= wrong.data());
                    CHECK(level.bytes.data() + level.bytes.size() <= wrong.data() + wrong.size());
                }
            } catch (const Error &) { // refused: as good
            }
        }
    }
}

TEST_CASE("KTX2: the message names file, place, value and limit") {
    test::Bytes file = test::ktx2_file(PixelFormat::rgba8_srgb, 4, 4);
    file[44] = std::byte{2}; // zstd
    CHECK_THROWS_WITH_AS(assets::read_ktx2(file, "a.ktx2"),
                         "a.ktx2: header: supercompression 2, must be 0 (none)", Error);
    file[44] = std::byte{0};
    file[12] = std::byte{146}; // BC7
    CHECK_THROWS_WITH_AS(assets::read_ktx2(file, "a.ktx2"),
                         "a.ktx2: header: vkFormat 146 is not among the formats that the player samples",
                         Error);
}
