// BC7 without Python: one CPU's bits are every CPU's, and what is packed can be read back.
#include <doctest/doctest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "bc7/encode.hpp"
#include "bc7/pack.hpp"
#include "bc7/widths.hpp"

using namespace paradize;

namespace {

// A fixed sequence: ramps, two colours or noise by turns of eight texels; opaque in the left half.
std::vector<std::uint8_t> blocks_of_all_kinds(std::size_t rows, std::size_t columns) {
    std::vector<std::uint8_t> out(rows * columns * 4);
    std::uint32_t state = 12345;
    for (std::size_t i = 0; i < out.size(); ++i) {
        state = state * 1664525U + 1013904223U;
        const std::size_t x = i / 4 % columns;
        const std::size_t y = i / 4 / columns;
        const std::size_t kinds[3] = {x * 5 + y * 3 * (i % 4), (x * 3 + y * 2) / 7 % 2 * 150 + i % 4,
                                      state >> 24};
        const bool opaque = i % 4 == 3 && x < columns / 2;
        out[i] = static_cast<std::uint8_t>(opaque ? 255 : kinds[x / 8 % 3]);
    }
    return out;
}

int bits(const std::uint8_t *block, int at, int count) {
    int value = 0;
    for (int i = 0; i < count; ++i) {
        value |= (block[(at + i) / 8] >> ((at + i) % 8) & 1) << i;
    }
    return value;
}

} // namespace

#ifdef PARADIZE_WIDE
TEST_CASE("every instruction set gives the same BC7 blocks") {
    const std::size_t rows = 8;
    const std::size_t columns = 402;
    const auto rgba = blocks_of_all_kinds(rows, columns);
    const bc7::Picture picture{rgba.data(), rows, columns};
    const auto scratch = std::make_unique<bc7::Scratch>();
    for (const bc7::Quality quality : {bc7::Quality::fast, bc7::Quality::balanced, bc7::Quality::exact}) {
        const auto run = [&](auto encode_row) {
            std::vector<std::uint8_t> out(bc7::blocks(rows, columns) * 16);
            for (std::size_t row = 0; row < picture.down(); ++row) {
                encode_row(picture, row, quality, 4.0F, *scratch, out.data() + row * picture.across() * 16);
            }
            return out;
        };
        const auto baseline = run(&bc7::baseline::encode_row);
        if (has_avx2()) {
            CHECK(run(&bc7::avx2::encode_row) == baseline);
        }
        if (has_avx512()) {
            CHECK(run(&bc7::avx512::encode_row) == baseline);
        }
    }
}
#endif

TEST_CASE("a BC7 block does not depend on its neighbours") {
    const std::size_t rows = 4;
    const std::size_t columns = 128;
    const auto rgba = blocks_of_all_kinds(rows, columns);
    std::vector<std::uint8_t> whole(columns / 4 * 16);
    bc7::encode(rgba, rows, columns, bc7::Quality::exact, 4.0F, whole, 1);
    for (std::size_t column = 0; column < columns / 4; ++column) {
        std::vector<std::uint8_t> one;
        for (std::size_t y = 0; y < 4; ++y) {
            const auto from = rgba.begin() + static_cast<std::ptrdiff_t>(4 * (y * columns + 4 * column));
            one.insert(one.end(), from, from + 16);
        }
        std::vector<std::uint8_t> alone(16);
        bc7::encode(one, 4, 4, bc7::Quality::exact, 4.0F, alone, 1);
        CHECK(std::vector<std::uint8_t>(whole.begin() + static_cast<std::ptrdiff_t>(16 * column),
                                        whole.begin() + static_cast<std::ptrdiff_t>(16 * column + 16)) ==
              alone);
    }
}

TEST_CASE("every mode fills its 128 bits and anchors stay small") {
    for (int mode = 0; mode < 8; ++mode) {
        const bc7::Mode &facts = bc7::modes[static_cast<std::size_t>(mode)];
        const int channels = facts.alpha_bits > 0 ? 4 : 3;
        const int used = mode + 1 + facts.partition_bits + facts.rotation_bits + facts.selector_bits +
                         2 * facts.subsets * (3 * facts.color_bits + facts.alpha_bits) +
                         facts.p * facts.subsets + 16 * (facts.index_bits + facts.second_bits) -
                         facts.subsets - (facts.second_bits > 0 ? 1 : 0);
        CHECK(used == 128);
        bc7::Choice choice{};
        choice.mode = mode;
        choice.partition = facts.partition_bits == 4 ? 15 : (facts.partition_bits == 6 ? 63 : 0);
        // The largest indices, so that every subset's ends change places.
        choice.index = std::uint64_t{0x1111111111111111} * ((1U << facts.index_bits) - 1);
        choice.second = std::uint64_t{0x1111111111111111} * ((1U << facts.second_bits) - 1);
        for (int s = 0; s < facts.subsets; ++s) {
            for (int c = 0; c < channels; ++c) {
                choice.code[s][1][c] = 1; // a low bit where the mode has them
            }
        }
        std::uint8_t block[16];
        bc7::pack(choice, block);
        CHECK(bits(block, 0, mode + 1) == (1 << mode));
        const int first_index = 128 - 16 * (facts.index_bits + facts.second_bits) + facts.subsets +
                                (facts.second_bits > 0 ? 1 : 0);
        for (int at = first_index; at < 128; ++at) {
            CHECK(bits(block, at, 1) == 0);
        }
    }
}

TEST_CASE("anchors lie in their subsets") {
    for (int partition = 0; partition < bc7::partitions; ++partition) {
        for (int subsets = 1; subsets <= 3; ++subsets) {
            for (int s = 0; s < subsets; ++s) {
                CHECK(bc7::subset_of(subsets, partition, bc7::anchor_of(subsets, partition, s)) == s);
            }
        }
    }
}

TEST_CASE("a solid block costs nothing whatever its value") {
    for (std::uint32_t value = 0; value < 256; ++value) {
        std::uint8_t block[16];
        bc7::pack_solid(value | value << 8 | value << 16 | value << 24, block);
        CHECK(bits(block, 0, 6) == 32);
        const int a = bc7::expanded(bits(block, 8, 7), 7);
        const int b = bc7::expanded(bits(block, 15, 7), 7);
        CHECK(((43 * a + 21 * b + 32) >> 6) == static_cast<int>(value));
        CHECK(bits(block, 50, 8) == static_cast<int>(value));
    }
}

TEST_CASE("threads and odd sizes touch nothing beyond the picture") {
    for (std::size_t rows = 1; rows <= 9; ++rows) {
        for (std::size_t columns = 1; columns <= 9; ++columns) {
            const auto rgba = blocks_of_all_kinds(rows, columns);
            std::vector<std::uint8_t> one(bc7::blocks(rows, columns) * 16);
            std::vector<std::uint8_t> two(one.size());
            bc7::encode(rgba, rows, columns, bc7::Quality::balanced, 4.0F, one, 1);
            bc7::encode(rgba, rows, columns, bc7::Quality::balanced, 4.0F, two, 3);
            CHECK(one == two);
        }
    }
}
