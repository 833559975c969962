#include "mesh/weld.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "math/vec.hpp"
#include "unify.hpp"

namespace paradize::mesh {
namespace {

constexpr std::uint32_t no_vertex = 0xffffffffu;

// A cube as wide as the tolerance. Whole numbers as doubles: where they no longer differ by one, floats of
// that size lie farther apart than the tolerance anyway.
using Cell = std::array<double, 3>;

std::uint64_t hash_of(const Cell &cell) {
    std::uint64_t h = hash_seed;
    for (const double side : cell) {
        const auto bits = std::bit_cast<std::uint64_t>(side + 0.0);
        h = mix(h, bits ^ (bits >> 32)); // of whole numbers only the highest bits differ
    }
    return h;
}

} // namespace

std::vector<std::uint32_t> weld(std::span<const float> positions, double tolerance) {
    const std::size_t count = positions.size() / 3;
    std::vector<std::uint32_t> result(count);
    if (count == 0)
        return result;
    Vec low = at3(positions, 0);
    for (std::size_t i = 1; i < count; ++i) {
        const Vec p = at3(positions, i);
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    }
    // Chains of the points that stand for themselves, by the hash of their cell; one cell holds eight at
    // most.
    std::vector<std::uint32_t> head(std::bit_ceil(count * 2), no_vertex), next(count, no_vertex);
    const std::size_t mask = head.size() - 1;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec p = at3(positions, i);
        const Cell cell = {std::floor((p.x - low.x) / tolerance), std::floor((p.y - low.y) / tolerance),
                           std::floor((p.z - low.z) / tolerance)};
        std::uint32_t best = no_vertex;
        double nearest = tolerance;
        for (int around = 0; around < 27; ++around) {
            const Cell beside = {cell[0] + (around % 3 - 1), cell[1] + (around / 3 % 3 - 1),
                                 cell[2] + (around / 9 - 1)};
            for (std::uint32_t j = head[hash_of(beside) & mask]; j != no_vertex; j = next[j]) {
                const double apart = length(at3(positions, j) - p);
                if (apart < nearest || (apart == nearest && j < best)) {
                    nearest = apart;
                    best = j;
                }
            }
        }
        result[i] = best == no_vertex ? static_cast<std::uint32_t>(i) : best;
        if (best == no_vertex) {
            std::uint32_t &first = head[hash_of(cell) & mask];
            next[i] = first;
            first = static_cast<std::uint32_t>(i);
        }
    }
    return result;
}

} // namespace paradize::mesh
