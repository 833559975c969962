#include "bc7_pack.hpp"

#include <utility>

namespace paradize::bc7 {

namespace {

// Bits from the lowest upward.
class Bits {
  public:
    void put(int value, int count) {
        const auto bits = static_cast<std::uint64_t>(static_cast<unsigned>(value));
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

// Makes the anchors' indices small; only channels first..last - 1 belong to these indices.
void turn(Choice &choice, const Mode &mode, int *index, int bits, int first, int last) {
    const int top = (1 << bits) - 1;
    for (int s = 0; s < mode.subsets; ++s) {
        if (index[anchor_of(mode.subsets, choice.partition, s)] <= top / 2) {
            continue;
        }
        for (int c = first; c < last; ++c) {
            std::swap(choice.code[s][0][c], choice.code[s][1][c]);
        }
        for (int t = 0; t < texels; ++t) {
            if (subset_of(mode.subsets, choice.partition, t) == s) {
                index[t] = top - index[t];
            }
        }
    }
}

void put_indices(Bits &bits, const Choice &choice, const Mode &mode, const int *index, int count) {
    for (int t = 0; t < texels; ++t) {
        bool anchor = false;
        for (int s = 0; s < mode.subsets; ++s) {
            anchor = anchor || t == anchor_of(mode.subsets, choice.partition, s);
        }
        bits.put(index[t], anchor ? count - 1 : count);
    }
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
    bits.put(1 << choice.mode, choice.mode + 1);
    bits.put(choice.partition, mode.partition_bits);
    bits.put(choice.rotation, mode.rotation_bits);
    bits.put(choice.selector, mode.selector_bits);
    const int low = mode.p != 0 ? 1 : 0;
    for (int c = 0; c < channels; ++c) {
        for (int s = 0; s < mode.subsets; ++s) {
            for (int end = 0; end < 2; ++end) {
                bits.put(choice.code[s][end][c] >> low, c < 3 ? mode.color_bits : mode.alpha_bits);
            }
        }
    }
    for (int s = 0; s < mode.subsets; ++s) {
        for (int end = 0; end < mode.p; ++end) {
            bits.put(choice.code[s][end][0] & 1, 1);
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
    for (int &index : choice.index) {
        index = 1;
    }
    pack(choice, out);
}

} // namespace paradize::bc7
