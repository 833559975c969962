#include "occlusion/directions.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "math/functions.hpp"

namespace paradize::occlusion {
namespace {

std::uint32_t reversed(std::uint32_t i) {
    std::uint32_t out = 0;
    for (int bit = 0; bit < 32; ++bit) {
        out |= ((i >> bit) & 1U) << (31 - bit);
    }
    return out;
}

// The second coordinate of Sobol's sequence: Pascal's triangle modulo two.
std::uint32_t second(std::uint32_t i) {
    std::uint32_t out = 0;
    for (std::uint32_t column = 0x80000000U; i != 0; i >>= 1, column ^= column >> 1) {
        out ^= (i & 1U) != 0 ? column : 0U;
    }
    return out;
}

// Bits of x and y in turn.
std::size_t interleaved(std::size_t x, std::size_t y, int bits) {
    std::size_t out = 0;
    for (int bit = 0; bit < bits; ++bit) {
        out |= ((x >> bit) & 1) << (2 * bit) | ((y >> bit) & 1) << (2 * bit + 1);
    }
    return out;
}

struct Ray {
    std::size_t place; // along a curve over the disk: near ones point alike
    double x, y, z;
};

} // namespace

std::size_t set_of(std::size_t row, std::size_t column) {
    return interleaved(column % block_side, row % block_side, std::bit_width(block_side - 1));
}

Directions make_directions(std::size_t rays) {
    Directions out{rays, {}, {}, {}};
    const double half = 0.5 / static_cast<double>(sets * rays), unit = 0x1p-32;
    std::vector<Ray> set(rays);
    for (std::size_t s = 0; s < sets; ++s) {
        for (std::size_t k = 0; k < rays; ++k) {
            const auto i = static_cast<std::uint32_t>(s * rays + k);
            const double u = reversed(i) * unit + half, v = second(i) * unit + half;
            const double r = std::sqrt(u), angle = 2 * mathx::pi * v;
            const auto cell = [](double share) { return static_cast<std::size_t>(share * 256); };
            set[k] = {interleaved(cell(u), cell(v), 8), r * mathx::cos(angle), r * mathx::sin(angle),
                      std::sqrt(1 - u)};
        }
        std::stable_sort(set.begin(), set.end(),
                         [](const Ray &a, const Ray &b) { return a.place < b.place; });
        for (const Ray &ray : set) {
            out.x.push_back(static_cast<float>(ray.x));
            out.y.push_back(static_cast<float>(ray.y));
            out.z.push_back(static_cast<float>(ray.z));
        }
    }
    return out;
}

} // namespace paradize::occlusion
