// Facts of the BC7 format: its eight modes, its partitions and their anchors.
// Source: Khronos, "Data Format Specification 1.3", chapter BPTC.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace paradize::bc7 {

constexpr int texels = 16;

// One mode's bits. p: 0 none, 1 one low bit shared by a subset's ends, 2 one for every end.
struct Mode {
    int subsets;
    int partition_bits;
    int rotation_bits;
    int selector_bits;
    int color_bits; // of a channel, without the p bit
    int alpha_bits; // 0: opaque
    int p;
    int index_bits;
    int second_bits; // indices of the channel that stands alone; 0: there is none
};

constexpr std::array<Mode, 8> modes{{
    {3, 4, 0, 0, 4, 0, 2, 3, 0},
    {2, 6, 0, 0, 6, 0, 1, 3, 0},
    {3, 6, 0, 0, 5, 0, 0, 2, 0},
    {2, 6, 0, 0, 7, 0, 2, 2, 0},
    {1, 0, 2, 1, 5, 6, 0, 2, 3},
    {1, 0, 2, 0, 7, 8, 0, 2, 2},
    {1, 0, 0, 0, 7, 7, 2, 4, 0},
    {2, 6, 0, 0, 5, 5, 2, 2, 0},
}};

constexpr int partitions = 64;
constexpr int partitions_of_mode0 = 16;

// Bit t: texel t belongs to subset 1.
constexpr std::array<std::uint16_t, partitions> two_subsets{
    0xcccc, 0x8888, 0xeeee, 0xecc8, 0xc880, 0xfeec, 0xfec8, 0xec80, 0xc800, 0xffec, 0xfe80, 0xe800, 0xffe8,
    0xff00, 0xfff0, 0xf000, 0xf710, 0x008e, 0x7100, 0x08ce, 0x008c, 0x7310, 0x3100, 0x8cce, 0x088c, 0x3110,
    0x6666, 0x366c, 0x17e8, 0x0ff0, 0x718e, 0x399c, 0xaaaa, 0xf0f0, 0x5a5a, 0x33cc, 0x3c3c, 0x55aa, 0x9696,
    0xa55a, 0x73ce, 0x13c8, 0x324c, 0x3bdc, 0x6996, 0xc33c, 0x9966, 0x0660, 0x0272, 0x04e4, 0x4e40, 0x2720,
    0xc936, 0x936c, 0x39c6, 0x639c, 0x9336, 0x9cc6, 0x817e, 0xe718, 0xccf0, 0x0fcc, 0x7744, 0xee22};

// Bits 2t and 2t + 1: the subset of texel t.
constexpr std::array<std::uint32_t, partitions> three_subsets{
    0xaa685050, 0x6a5a5040, 0x5a5a4200, 0x5450a0a8, 0xa5a50000, 0xa0a05050, 0x5555a0a0, 0x5a5a5050,
    0xaa550000, 0xaa555500, 0xaaaa5500, 0x90909090, 0x94949494, 0xa4a4a4a4, 0xa9a59450, 0x2a0a4250,
    0xa5945040, 0x0a425054, 0xa5a5a500, 0x55a0a0a0, 0xa8a85454, 0x6a6a4040, 0xa4a45000, 0x1a1a0500,
    0x0050a4a4, 0xaaa59090, 0x14696914, 0x69691400, 0xa08585a0, 0xaa821414, 0x50a4a450, 0x6a5a0200,
    0xa9a58000, 0x5090a0a8, 0xa8a09050, 0x24242424, 0x00aa5500, 0x24924924, 0x24499224, 0x50a50a50,
    0x500aa550, 0xaaaa4444, 0x66660000, 0xa5a0a5a0, 0x50a050a0, 0x69286928, 0x44aaaa44, 0x66666600,
    0xaa444444, 0x54a854a8, 0x95809580, 0x96969600, 0xa85454a8, 0x80959580, 0xaa141414, 0x96960000,
    0xaaaa1414, 0xa05050a0, 0xa0a5a5a0, 0x96000000, 0x40804080, 0xa9a8a9a8, 0xaaaaaa44, 0x2a4a5254};

// The texel of subset 1 (and 2) whose index is written without its highest bit; of subset 0 it is texel 0.
constexpr std::array<std::uint8_t, partitions> anchors_of_two{
    15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 2,  8, 2, 2, 8,
    8,  15, 2,  8,  2,  2,  8,  8,  2,  2,  15, 15, 6,  8,  2,  8,  15, 15, 2, 8, 2, 2,
    2,  15, 15, 6,  6,  2,  6,  8,  15, 15, 2,  2,  15, 15, 15, 15, 15, 2,  2, 15};
constexpr std::array<std::array<std::uint8_t, 2>, partitions> anchors_of_three{
    {{3, 15},  {3, 8},  {15, 8},  {15, 3}, {8, 15},  {3, 15}, {15, 3},  {15, 8}, {8, 15},  {8, 15}, {6, 15},
     {6, 15},  {6, 15}, {5, 15},  {3, 15}, {3, 8},   {3, 15}, {3, 8},   {8, 15}, {15, 3},  {3, 15}, {3, 8},
     {6, 15},  {10, 8}, {5, 3},   {8, 15}, {8, 6},   {6, 10}, {8, 15},  {5, 15}, {15, 10}, {15, 8}, {8, 15},
     {15, 3},  {3, 15}, {5, 10},  {6, 10}, {10, 8},  {8, 9},  {15, 10}, {15, 6}, {3, 15},  {15, 8}, {5, 15},
     {15, 3},  {15, 6}, {15, 6},  {15, 8}, {3, 15},  {15, 3}, {5, 15},  {5, 15}, {5, 15},  {8, 15}, {5, 15},
     {10, 15}, {5, 15}, {10, 15}, {8, 15}, {13, 15}, {15, 3}, {12, 15}, {3, 15}, {3, 8}}};

// The subset of a texel in a partition of one, two or three subsets.
constexpr int subset_of(int subsets, int partition, int texel) {
    const auto at = static_cast<std::size_t>(partition);
    if (subsets == 2) {
        return two_subsets[at] >> texel & 1;
    }
    return subsets == 3 ? static_cast<int>(three_subsets[at] >> (2 * texel) & 3) : 0;
}

constexpr int anchor_of(int subsets, int partition, int subset) {
    const auto at = static_cast<std::size_t>(partition);
    if (subset == 0) {
        return 0;
    }
    return subsets == 2 ? anchors_of_two[at] : anchors_of_three[at][static_cast<std::size_t>(subset - 1)];
}

// The value 0..255 of a code of `bits` bits, 5..8: its highest bits are repeated below.
constexpr int expanded(int code, int bits) {
    return (code << (8 - bits) | code >> (2 * bits - 8)) & 255;
}

} // namespace paradize::bc7
