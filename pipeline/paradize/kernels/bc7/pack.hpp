// A block's choice as 128 bits.
#pragma once

#include "bc7/effort.hpp"

namespace paradize::bc7 {

// One block's choice; codes hold their low bits. Indices: four bits for each texel, the first lowest.
struct Choice {
    int mode;
    int partition;
    int rotation;
    int selector;
    int code[3][2][4]; // [subset][end][channel]
    std::uint64_t index;
    std::uint64_t second; // of the channel that stands alone, in modes 4 and 5
};

// Writes 16 bytes. Turns a subset's ends round where its anchor's index needs its highest bit.
void pack(Choice &choice, std::uint8_t *out);

// A block of one colour, exactly, in mode 5. rgba: red in the lowest byte.
void pack_solid(std::uint32_t rgba, std::uint8_t *out);

} // namespace paradize::bc7
