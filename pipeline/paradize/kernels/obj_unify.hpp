// Numbers rows and index triples by value, so that equal ones share one number.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::obj {

// The number of the first row with the same bits (-0 counts as 0), for each of n rows of `width` floats.
std::vector<std::uint32_t> first_equal_row(std::span<const float> rows, std::size_t width);

struct Corner {
    std::uint32_t position, uv, normal; // `absent` where a corner has none
    bool operator==(const Corner &) const = default;
};

struct Unified {
    std::vector<std::uint32_t> index; // vertex of each corner
    std::vector<Corner> vertices;     // in order of first use
};

// Gives each different corner a vertex.
Unified unify(std::span<const Corner> corners);

} // namespace paradize::obj
