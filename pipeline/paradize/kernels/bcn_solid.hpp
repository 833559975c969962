// For blocks of one colour: which pair of 5- or 6-bit endpoints comes nearest to an 8-bit code two thirds
// along.
#pragma once

#include <cstdint>

namespace paradize::bcn {

struct SolidPair {
    std::uint8_t a; // the end that counts twice
    std::uint8_t b;
};

struct SolidTables {
    SolidPair pairs[2][256]; // of 5 bits, of 6 bits

    SolidTables() {
        for (int bits = 0; bits < 2; ++bits) {
            const int top = bits == 0 ? 31 : 63;
            for (int code = 0; code < 256; ++code) {
                float best = 1e9F;
                for (int a = 0; a <= top; ++a) {
                    for (int b = 0; b <= top; ++b) {
                        const float value = static_cast<float>(2 * a + b) * (85.0F / static_cast<float>(top));
                        const float off = value - static_cast<float>(code);
                        // Decoders that round differ least where the ends are near each other.
                        const float error = off * off + static_cast<float>(a > b ? a - b : b - a) * 1e-3F;
                        if (error < best) {
                            best = error;
                            pairs[bits][code] = {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)};
                        }
                    }
                }
            }
        }
    }
};

} // namespace paradize::bcn
