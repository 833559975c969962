#include "maps/codes.hpp"

#include "parallel.hpp"

#include <algorithm>
#include <array>

namespace paradize::maps {
namespace {

std::int8_t snorm_code(float v) {
    const float scaled = (v < -1.0F ? -1.0F : (v > 1.0F ? 1.0F : v)) * 127.0F;
    return static_cast<std::int8_t>(scaled < 0.0F ? scaled - 0.5F : scaled + 0.5F);
}

constexpr int rest_steps = 64; // of one code

// The rounding error of v, in the range of int8.
std::int8_t rest_of(float v, std::int8_t code) {
    const float left = (v * 127.0F - static_cast<float>(code)) * static_cast<float>(rest_steps);
    return static_cast<std::int8_t>(left < -127.0F ? -127.0F : (left > 127.0F ? 127.0F : left));
}

// One round over channel c: moves up to |sum| codes by one against the sign of `sum`; returns what that adds.
std::int64_t move_codes(std::span<std::int8_t> codes, std::span<std::int8_t> rest, std::size_t c,
                        std::int64_t sum) {
    const int step = sum > 0 ? -1 : 1;
    // How much a move brings a code towards its value: the rest in the direction of the move.
    const auto gain = [&](std::size_t i) { return static_cast<std::size_t>(128 + step * rest[i]); };
    const auto movable = [&](std::size_t i) { return codes[i] != 127 * step; };
    std::array<std::size_t, 256> counts{};
    for (std::size_t i = c; i < codes.size(); i += 2) {
        counts[gain(i)] += movable(i) ? 1 : 0;
    }
    auto left = static_cast<std::size_t>(sum > 0 ? sum : -sum);
    std::size_t level = counts.size(); // everything from `level` on moves, and `left` of the one below
    while (level > 0 && counts[level - 1] <= left) {
        left -= counts[--level];
    }
    std::int64_t moved = 0;
    for (std::size_t i = c; i < codes.size(); i += 2) {
        const std::size_t g = gain(i);
        const bool partly = g + 1 == level && left > 0;
        if (!movable(i) || (g < level && !partly)) {
            continue;
        }
        left -= g < level ? 1 : 0;
        codes[i] = static_cast<std::int8_t>(codes[i] + step);
        rest[i] = static_cast<std::int8_t>(std::clamp(rest[i] - step * rest_steps, -127, 127));
        moved += step;
    }
    return moved;
}

} // namespace

void snorm8(std::span<const float> in, std::span<std::int8_t> out, int threads) {
    for_rows(in.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            out[i] = snorm_code(in[i]);
        }
    });
}

void dudv_codes(std::span<const float> vectors, std::span<const double> mean, std::span<std::int8_t> codes,
                std::span<std::int8_t> rest, int threads) {
    for_rows(codes.size() / 2, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            for (std::size_t c = 0; c < 2; ++c) {
                const auto v = static_cast<float>(vectors[3 * i + c] - mean[c]);
                const std::int8_t code = snorm_code(v);
                codes[2 * i + c] = code;
                rest[2 * i + c] = rest_of(v, code);
            }
        }
    });
}

void balance(std::span<std::int8_t> codes, std::span<std::int8_t> rest) {
    for (std::size_t c = 0; c < 2; ++c) {
        std::int64_t sum = 0;
        for (std::size_t i = c; i < codes.size(); i += 2) {
            sum += codes[i];
        }
        while (sum != 0) {
            sum += move_codes(codes, rest, c, sum);
        }
    }
}

} // namespace paradize::maps
