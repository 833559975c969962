#include "assets/inflate.hpp"
#include "assets/ktx2.hpp"
#include "error.hpp"
#include "files.hpp"

#include <algorithm>
#include <cstring>
#include <doctest/doctest.h>

using namespace paradize;
using assets::PixelFormat;

namespace {

/// Decompresses all levels and returns the first error.
std::string inflate_all(const assets::Ktx2 &ktx) {
    assets::Inflater inflater;
    for (const assets::Ktx2Level &level : ktx.levels) {
        if (const std::string error = inflater.inflate(level.compressed, level.inflated); !error.empty()) {
            return error;
        }
    }
    return {};
}

} // namespace

TEST_CASE("KTX2: every level of every format is found at its offset") {
    for (const PixelFormat format :
         {PixelFormat::r8_unorm, PixelFormat::rg8_snorm, PixelFormat::rgba8_srgb, PixelFormat::r16_unorm,
          PixelFormat::rgba16_float, PixelFormat::r32_float, PixelFormat::bc1_rgb_srgb, PixelFormat::bc3_srgb,
          PixelFormat::bc4_unorm, PixelFormat::bc5_snorm, PixelFormat::bc7_srgb, PixelFormat::bc7_unorm,
          PixelFormat::rg16_snorm, PixelFormat::rg16_unorm}) {
        const test::Bytes file = test::ktx2_file(format, 20, 8);
        const assets::Ktx2 ktx = test::read_ktx2(file, "t.ktx2");
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
    const assets::Ktx2 ktx = test::read_ktx2(file, "sky.ktx2");
    CHECK(ktx.faces == 6);
    CHECK(ktx.levels[0].bytes.size() == 4 * 4 * 8 * 6);
}

TEST_CASE("KTX2: a file truncated anywhere is rejected and never read past its end") {
    const test::Bytes file = test::ktx2_file(PixelFormat::bc1_rgb_srgb, 16, 16);
    for (std::size_t length = 0; length < file.size(); ++length) {
        const test::Bytes cut(file.begin(),
                              // on the heap, so that ASan finds reads past the end
                              file.begin() + static_cast<std::ptrdiff_t>(length));
        CHECK_THROWS_AS(test::read_ktx2(cut, "cut.ktx2"), Error);
    }
}

TEST_CASE("KTX2: any wrong byte in the header is harmless") {
    const test::Bytes file = test::ktx2_file(PixelFormat::rg8_snorm, 16, 8);
    for (std::size_t at = 0; at < 80 + 24 * 5; ++at) {
        for (const unsigned value : {0x00U, 0x01U, 0x7FU, 0xFFU}) {
            test::Bytes wrong = file;
            wrong[at] = static_cast<std::byte>(value);
            try {
                const assets::Ktx2 ktx = test::read_ktx2(wrong, "wrong.ktx2");
                for (const assets::Ktx2Level &level : ktx.levels) {
                    CHECK(level.bytes.data() >= wrong.data());
                    CHECK(level.bytes.data() + level.bytes.size() <= wrong.data() + wrong.size());
                }
            } catch (const Error &) { // rejected, which is fine
            }
        }
    }
}

TEST_CASE("KTX2: the message names file, place, value and limit") {
    test::Bytes file = test::ktx2_file(PixelFormat::rgba8_srgb, 4, 4);
    file[44] = std::byte{3}; // ZLIB
    CHECK_THROWS_WITH_AS(test::read_ktx2(file, "a.ktx2"),
                         "a.ktx2: header: supercompression 3, must be 0 (none) or 2 (Zstandard)", Error);
    file[44] = std::byte{0};
    file[12] = std::byte{143}; // BC6H
    CHECK_THROWS_WITH_AS(test::read_ktx2(file, "a.ktx2"),
                         "a.ktx2: header: vkFormat 143 is not among the formats that the player samples",
                         Error);
}

TEST_CASE("KTX2: a level outside the file is reported by its offset, a wrong size by the size") {
    const test::Bytes file = test::ktx2_file(PixelFormat::rgba8_srgb, 64, 64);
    const auto message_of = [&](std::size_t at, std::uint64_t value) -> std::string {
        test::Bytes wrong = file;
        std::memcpy(wrong.data() + at, &value, sizeof value);
        try {
            test::read_ktx2(wrong, "a.ktx2");
        } catch (const Error &error) {
            return error.what();
        }
        return "";
    };
    const std::string size = std::to_string(file.size());
    CHECK(message_of(80, file.size() - 16383) == "a.ktx2: level 0: 16384 bytes from byte " +
                                                     std::to_string(file.size() - 16383) +
                                                     " on exceed a file of " + size);
    CHECK(message_of(80, ~std::uint64_t{0}) ==
          "a.ktx2: level 0: 16384 bytes from byte 18446744073709551615 on exceed a file of " + size);
    CHECK(message_of(88, 16383) ==
          "a.ktx2: level 0: the level index says 16383 bytes, 64 x 64 texels take 16384");
}

TEST_CASE("KTX2: a compressed file has the same levels as the uncompressed file") {
    for (const PixelFormat format :
         {PixelFormat::bc7_srgb, PixelFormat::rg16_snorm, PixelFormat::r8_unorm, PixelFormat::rgba16_float}) {
        for (const std::uint32_t faces : {1U, 6U}) {
            const test::Bytes plain = test::ktx2_file(format, 36, 36, faces);
            const test::Bytes compressed = test::zstd_ktx2_file(format, 36, 36, faces);
            CHECK(compressed.size() < plain.size());
            const assets::Ktx2 expected = test::read_ktx2(plain, "plain.ktx2");
            const assets::Ktx2 ktx = test::read_ktx2(compressed, "packed.ktx2");
            REQUIRE(inflate_all(ktx).empty());
            REQUIRE(ktx.levels.size() == expected.levels.size());
            for (std::size_t i = 0; i < ktx.levels.size(); ++i) {
                CHECK(std::ranges::equal(ktx.levels[i].bytes, expected.levels[i].bytes));
                CHECK(ktx.levels[i].width_px == expected.levels[i].width_px);
            }
        }
    }
}

TEST_CASE("KTX2: a frame with another size than its level is rejected, decompression bombs included") {
    const test::Bytes file = test::zstd_ktx2_file(PixelFormat::r8_unorm, 64, 64);
    const test::Bytes level(64 * 64, std::byte{7});
    const auto read = [&](std::span<const std::byte> frame) {
        return test::read_ktx2(test::with_frame(file, frame), "bad.ktx2");
    };
    const test::Bytes bomb(std::size_t{1} << 26U);
    CHECK_THROWS_WITH_AS(
        read(test::zstd_frame(bomb)),
        doctest::Contains("bad.ktx2: level 0: its Zstandard frame says 67108864 bytes, expected 4096; bake"),
        Error);
    CHECK_THROWS_WITH_AS(read(test::Bytes(100, std::byte{1})),
                         doctest::Contains("bad.ktx2: level 0: is not a Zstandard frame; bake"), Error);
    CHECK_THROWS_AS(read({}), Error);
    const test::Bytes skippable{std::byte{0x50}, std::byte{0x2A}, std::byte{0x4D},
                                std::byte{0x18}, std::byte{1},    std::byte{0},
                                std::byte{0},    std::byte{0},    std::byte{9}};
    CHECK_THROWS_AS(read(skippable), Error);

    // Without a stated content size, a wrong size shows during decompression. Nothing is written past the
    // level.
    const auto inflate = [&](std::span<const std::byte> frame) {
        const test::Bytes bad = test::with_frame(file, frame); // must outlive the spans
        assets::Inflater inflater;
        const assets::Ktx2 ktx = test::read_ktx2(bad, "bad.ktx2");
        // on the heap, so that ASan finds writes past the end
        test::Bytes out(ktx.levels[0].inflated.size());
        return inflater.inflate(ktx.levels[0].compressed, out);
    };
    const std::span<const std::byte> all(level);
    CHECK(inflate(test::zstd_frame(all, false)).empty());
    CHECK(inflate(test::zstd_frame(bomb, false)).find("is damaged: ") != std::string::npos);
    CHECK(inflate(test::zstd_frame(all.first(4095), false)) ==
          "its Zstandard frame holds 4095 bytes, expected 4096");
    test::Bytes two = test::zstd_frame(all);
    two.insert(two.end(), skippable.begin(), skippable.end());
    CHECK(inflate(two) == "9 bytes follow its Zstandard frame");
    test::Bytes cut = test::zstd_frame(all);
    cut.pop_back();
    CHECK_FALSE(inflate(cut).empty());
}

TEST_CASE("KTX2: wrong lengths and levels that decompress above the limit are rejected") {
    test::Bytes file = test::zstd_ktx2_file(PixelFormat::r8_unorm, 8, 8);
    file[96] = std::byte{65};
    CHECK_THROWS_WITH_AS(test::read_ktx2(file, "lie.ktx2"),
                         "lie.ktx2: level 0: 65 bytes uncompressed, expected 64", Error);
    // 16384 x 16384 half floats: level 0 fits into 2 GiB, a second level does not.
    test::Bytes large = test::zstd_ktx2_file(PixelFormat::rgba16_float, 2, 2);
    const auto put = [&](std::size_t at, auto value) {
        std::memcpy(large.data() + at, &value, sizeof value);
    };
    put(20, 16384U);
    put(24, 16384U);
    put(96, std::uint64_t{16384} * 16384 * 8);
    put(120, std::uint64_t{8192} * 8192 * 8);
    const test::Bytes frame = test::zstd_frame(test::Bytes(8), false);
    for (const std::size_t entry : {80U, 104U}) { // both levels use one frame without a content size
        put(entry, std::uint64_t{large.size()});
        put(entry + 8, std::uint64_t{frame.size()});
    }
    large.insert(large.end(), frame.begin(), frame.end());
    CHECK_THROWS_WITH_AS(test::read_ktx2(large, "large.ktx2"),
                         "large.ktx2: level 1: decompresses to more than 2147483648 bytes", Error);
}

TEST_CASE("KTX2: any wrong byte of a compressed file is harmless") {
    const test::Bytes file = test::zstd_ktx2_file(PixelFormat::rg8_snorm, 16, 8);
    int refused = 0;
    for (std::size_t at = 0; at < file.size(); ++at) {
        for (const unsigned flip : {0x01U, 0x40U, 0xFFU}) {
            test::Bytes wrong = file;
            wrong[at] ^= static_cast<std::byte>(flip);
            try {
                refused += inflate_all(test::read_ktx2(wrong, "wrong.ktx2")).empty() ? 0 : 1;
            } catch (const Error &) {
                ++refused;
            }
        }
    }
    CHECK(refused > 100);
    for (std::size_t length = 0; length < file.size(); ++length) {
        const test::Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
        CHECK_THROWS_AS(test::read_ktx2(cut, "cut.ktx2"), Error);
    }
}
