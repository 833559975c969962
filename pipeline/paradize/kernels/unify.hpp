// Numbers items by value, so that equal ones share one number. Header only; used by the obj and mesh kernels.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

inline constexpr std::uint64_t hash_seed = 0x243f6a8885a308d3ull;

constexpr std::uint64_t mix(std::uint64_t h, std::uint64_t word) {
    h ^= word;
    h *= 0x9e3779b97f4a7c15ull;
    return h ^ (h >> 32);
}

// The bits of a float, -0 counted as 0, so that equal floats have equal bits.
inline std::uint32_t float_key(float value) {
    return std::bit_cast<std::uint32_t>(value + 0.0f);
}

struct Numbered {
    std::vector<std::uint32_t> index; // number of each item, numbers given in order of first use
    std::vector<std::uint32_t> first; // the first item with each number
};

// Items 0 .. count-1 (below 2^32 - 1) with `hash(i)` and `equal(i, j)`. Open addressing, doubled at half
// load.
template <typename Hash, typename Equal>
Numbered number_equal(std::size_t count, Hash hash, Equal equal) {
    constexpr std::uint32_t empty = 0xffffffffu;
    Numbered result;
    result.index.resize(count);
    std::vector<std::uint32_t> table(1024, empty);
    std::size_t mask = table.size() - 1;
    for (std::size_t i = 0; i < count; ++i) {
        if (result.first.size() * 2 >= table.size()) {
            table.assign(table.size() * 4, empty);
            mask = table.size() - 1;
            for (std::size_t k = 0; k < result.first.size(); ++k) {
                std::size_t slot = hash(result.first[k]) & mask;
                while (table[slot] != empty)
                    slot = (slot + 1) & mask;
                table[slot] = static_cast<std::uint32_t>(k);
            }
        }
        std::size_t slot = hash(i) & mask;
        while (table[slot] != empty && !equal(result.first[table[slot]], i))
            slot = (slot + 1) & mask;
        if (table[slot] == empty) {
            table[slot] = static_cast<std::uint32_t>(result.first.size());
            result.first.push_back(static_cast<std::uint32_t>(i));
        }
        result.index[i] = table[slot];
    }
    return result;
}

// Rows of `width` finite floats, numbered by value.
inline Numbered number_rows(std::span<const float> rows, std::size_t width) {
    return number_equal(
        rows.size() / width,
        [&](std::size_t i) {
            std::uint64_t h = hash_seed;
            for (std::size_t k = 0; k < width; ++k)
                h = mix(h, float_key(rows[i * width + k]));
            return h;
        },
        [&](std::size_t a, std::size_t b) {
            for (std::size_t k = 0; k < width; ++k)
                if (rows[a * width + k] != rows[b * width + k])
                    return false;
            return true;
        });
}

} // namespace paradize
