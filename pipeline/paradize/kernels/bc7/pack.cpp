#include "bc7/pack.hpp"

#include <utility>

namespace paradize::bc7 {

namespace {

// Bits from the lowest upward.
class Bits {
  public:
    void put(std::uint64_t bits, int count) {
        words_[at_ / 64] |= bits << (at_ % 64);
        if (at_ % 64 + count > 64) {
            words_[at_ / 64 + 1] |= bits >> (64 - at_ % 64);
        }
        at_ += count;
    }

    void write(std::uint8_t *out) const {
        for (int i = 0; i < 16; ++i) {
            out[i] = static_cast<std::uint8_t>(words_[i / 8] >> (8 * (i % 8)));
        }
    }

  private:
    std::uint64_t words_[2] = {0, 0};
    int at_ = 0;
};

// 1 in the four bits of every texel of a subset.
std::uint64_t members(int subsets, int partition, int subset) {
    constexpr std::uint64_t ones = 0x1111111111111111;
    if (subsets == 1) {
        return ones;
    }
    // Every texel's bits of the table move to the bottom of its four.
    const auto at = static_cast<std::size_t>(partition);
    if (subsets == 2) {
        std::uint64_t spread = two_subsets[at];
        spread = (spread | spread << 24) & 0x000000ff000000ff;
        spread = (spread | spread << 12) & 0x000f000f000f000f;
        spread = (spread | spread << 6) & 0x0303030303030303;
        spread = (spread | spread << 3) & ones;
        return subset == 1 ? spread : spread ^ ones;
    }
    std::uint64_t spread = three_subsets[at];
    spread = (spread | spread << 16) & 0x0000ffff0000ffff;
    spread = (spread | spread << 8) & 0x00ff00ff00ff00ff;
    spread = (spread | spread << 4) & 0x0f0f0f0f0f0f0f0f;
    spread = (spread | spread << 2) & 0x3333333333333333;
    const std::uint64_t low = spread & ones;
    const std::uint64_t high = spread >> 1 & ones;
    return subset == 0 ? (low | high) ^ ones : (subset == 1 ? low : high);
}

// Makes the anchors' indices small; only channels first..last - 1 belong to these indices.
void turn(Choice &choice, const Mode &mode, std::uint64_t &index, int bits, int first, int last) {
    for (int s = 0; s < mode.subsets; ++s) {
        const int highest = 4 * anchor_of(mode.subsets, choice.partition, s) + bits - 1;
        if ((index >> highest & 1) == 0) {
            continue;
        }
        for (int c = first; c < last; ++c) {
            std::swap(choice.code[s][0][c], choice.code[s][1][c]);
        }
        // The largest index less an index is the index with all bits changed.
        index ^= members(mode.subsets, choice.partition, s) * ((1U << bits) - 1);
    }
}

// Sixteen indices of `count` bits side by side; the anchors' highest bits, which are zero, are left out.
void put_indices(Bits &bits, const Choice &choice, const Mode &mode, std::uint64_t index, int count) {
    index = (index & 0x0f0f0f0f0f0f0f0f) | (index >> 4 & 0x0f0f0f0f0f0f0f0f) << count;
    index = (index & 0x00ff00ff00ff00ff) | (index >> 8 & 0x00ff00ff00ff00ff) << 2 * count;
    index = (index & 0x0000ffff0000ffff) | (index >> 16 & 0x0000ffff0000ffff) << 4 * count;
    index = (index & 0x00000000ffffffff) | index >> 32 << 8 * count;
    int anchors[3];
    for (int s = 0; s < mode.subsets; ++s) {
        anchors[s] = anchor_of(mode.subsets, choice.partition, s);
    }
    if (mode.subsets == 3 && anchors[1] > anchors[2]) {
        std::swap(anchors[1], anchors[2]);
    }
    for (int s = mode.subsets - 1; s >= 0; --s) {
        const int at = (anchors[s] + 1) * count - 1;
        const std::uint64_t below = index & ((std::uint64_t{1} << at) - 1);
        index = below | index >> at >> 1 << at;
    }
    bits.put(index, 16 * count - mode.subsets);
}

// The two 7-bit codes between which a third of the way is each value exactly.
struct SolidCodes {
    std::uint8_t code[256][2];

    constexpr SolidCodes() : code{} {
        for (int value = 0; value < 256; ++value) {
            for (int a = 0; a < 128; ++a) {
                for (int b = 0; b < 128; ++b) {
                    if ((43 * expanded(a, 7) + 21 * expanded(b, 7) + 32) >> 6 == value &&
                        (a - b < 8 && b - a < 8)) {
                        code[value][0] = static_cast<std::uint8_t>(a);
                        code[value][1] = static_cast<std::uint8_t>(b);
                    }
                }
            }
        }
    }
};

} // namespace

void pack(Choice &choice, std::uint8_t *out) {
    const Mode &mode = modes[static_cast<std::size_t>(choice.mode)];
    const bool apart = mode.second_bits > 0;
    const int channels = mode.alpha_bits > 0 ? 4 : 3;
    // In mode 4 the selector says which of the two sizes of indices the colour has.
    const bool swapped = choice.selector != 0;
    const int color_bits = swapped ? mode.second_bits : mode.index_bits;
    const int alone_bits = swapped ? mode.index_bits : mode.second_bits;
    turn(choice, mode, choice.index, color_bits, 0, apart ? 3 : channels);
    if (apart) {
        turn(choice, mode, choice.second, alone_bits, 3, 4);
    }
    Bits bits;
    bits.put(std::uint64_t{1} << choice.mode, choice.mode + 1);
    bits.put(static_cast<unsigned>(choice.partition), mode.partition_bits);
    bits.put(static_cast<unsigned>(choice.rotation), mode.rotation_bits);
    bits.put(static_cast<unsigned>(choice.selector), mode.selector_bits);
    const int low = mode.p != 0 ? 1 : 0;
    for (int c = 0; c < channels; ++c) {
        for (int s = 0; s < mode.subsets; ++s) {
            for (int end = 0; end < 2; ++end) {
                const auto code = static_cast<unsigned>(choice.code[s][end][c]);
                bits.put(code >> low, c < 3 ? mode.color_bits : mode.alpha_bits);
            }
        }
    }
    for (int s = 0; s < mode.subsets; ++s) {
        for (int end = 0; end < mode.p; ++end) {
            bits.put(static_cast<unsigned>(choice.code[s][end][0]) & 1, 1);
        }
    }
    put_indices(bits, choice, mode, swapped ? choice.second : choice.index, mode.index_bits);
    if (apart) {
        put_indices(bits, choice, mode, swapped ? choice.index : choice.second, mode.second_bits);
    }
    bits.write(out);
}

void pack_solid(std::uint32_t rgba, std::uint8_t *out) {
    static const SolidCodes codes;
    Choice choice{};
    choice.mode = 5;
    for (int c = 0; c < 3; ++c) {
        choice.code[0][0][c] = codes.code[rgba >> (8 * c) & 255][0];
        choice.code[0][1][c] = codes.code[rgba >> (8 * c) & 255][1];
    }
    choice.code[0][0][3] = choice.code[0][1][3] = static_cast<int>(rgba >> 24);
    choice.index = 0x1111111111111111;
    pack(choice, out);
}

} // namespace paradize::bc7
