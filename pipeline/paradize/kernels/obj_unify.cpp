#include "obj_unify.hpp"

#include <bit>
#include <cstddef>

namespace paradize::obj {
namespace {

constexpr std::uint32_t empty = 0xffffffffu;

std::uint64_t mix(std::uint64_t h, std::uint64_t word) {
    h ^= word;
    h *= 0x9e3779b97f4a7c15ull;
    return h ^ (h >> 32);
}

std::size_t table_size(std::size_t items) {
    return std::bit_ceil(items * 2 + 16);
}

} // namespace

std::vector<std::uint32_t> first_equal_row(std::span<const float> rows, std::size_t width) {
    const std::size_t count = rows.size() / width;
    std::vector<std::uint32_t> table(table_size(count), empty);
    std::vector<std::uint32_t> first(count);
    const std::size_t mask = table.size() - 1;
    const auto same = [&](std::size_t a, std::size_t b) {
        for (std::size_t k = 0; k < width; ++k)
            if (rows[a * width + k] != rows[b * width + k])
                return false;
        return true;
    };
    for (std::size_t i = 0; i < count; ++i) {
        std::uint64_t h = 0x243f6a8885a308d3ull;
        for (std::size_t k = 0; k < width; ++k)
            h = mix(h, std::bit_cast<std::uint32_t>(rows[i * width + k] + 0.0f));
        std::size_t slot = h & mask;
        while (table[slot] != empty && !same(table[slot], i))
            slot = (slot + 1) & mask;
        if (table[slot] == empty)
            table[slot] = static_cast<std::uint32_t>(i);
        first[i] = table[slot];
    }
    return first;
}

Unified unify(std::span<const Corner> corners) {
    Unified result;
    result.index.resize(corners.size());
    std::vector<std::uint32_t> table(1024, empty);
    std::size_t mask = table.size() - 1;
    const auto hash = [](const Corner &c) {
        return mix(mix(mix(0x13198a2e03707344ull, c.position), c.uv), c.normal);
    };
    const auto grow = [&] {
        table.assign(table.size() * 4, empty);
        mask = table.size() - 1;
        for (std::size_t i = 0; i < result.vertices.size(); ++i) {
            std::size_t slot = hash(result.vertices[i]) & mask;
            while (table[slot] != empty)
                slot = (slot + 1) & mask;
            table[slot] = static_cast<std::uint32_t>(i);
        }
    };
    for (std::size_t i = 0; i < corners.size(); ++i) {
        if (result.vertices.size() * 2 >= table.size())
            grow();
        std::size_t slot = hash(corners[i]) & mask;
        while (table[slot] != empty && result.vertices[table[slot]] != corners[i])
            slot = (slot + 1) & mask;
        if (table[slot] == empty) {
            table[slot] = static_cast<std::uint32_t>(result.vertices.size());
            result.vertices.push_back(corners[i]);
        }
        result.index[i] = table[slot];
    }
    return result;
}

} // namespace paradize::obj
