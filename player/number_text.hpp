#pragma once
// Formats numbers for messages.

#include <array>
#include <charconv>
#include <string>

namespace paradize {

/// Returns the shortest text that reads back as the same number, so that different numbers look different.
/// Uses powers of ten only for very large and very small numbers.
template <typename Number>
std::string shortest(Number value) {
    const Number size = value < 0 ? -value : value;
    const bool plain = size == 0 || (size >= Number(1e-4) && size < Number(1e15));
    std::array<char, 64> out{};
    char *const end = out.data() + out.size();
    return {out.data(), std::to_chars(out.data(), end, value,
                                      plain ? std::chars_format::fixed : std::chars_format::scientific)
                            .ptr};
}

/// Returns the number with `digits` digits after the point.
inline std::string fixed(double value, int digits) {
    std::array<char, 400> out{}; // the largest double has 309 digits before the point
    return {out.data(),
            std::to_chars(out.data(), out.data() + out.size(), value, std::chars_format::fixed, digits).ptr};
}

} // namespace paradize
