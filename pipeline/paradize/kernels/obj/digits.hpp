// The value of up to eight digits of text, read as one word of 64 bits. Little endian.
#pragma once

#include <cstdint>
#include <cstring>

namespace paradize::obj {

// The value of the `count` digits at `p`, 1 to 8, of which eight bytes can be read: pairs, then fours, then
// eight are joined by multiplications.
inline std::uint32_t digits(const char *p, unsigned count) {
    std::uint64_t word = 0;
    std::memcpy(&word, p, 8);
    word = (word << (64 - 8 * count)) & 0x0f0f0f0f0f0f0f0full;
    word = word * 10 + (word >> 8);
    return static_cast<std::uint32_t>((((word & 0x000000ff000000ffull) * 0x000f424000000064ull) +
                                       (((word >> 16) & 0x000000ff000000ffull) * 0x0000271000000001ull)) >>
                                      32);
}

} // namespace paradize::obj
