#include "maps_codes.hpp"

#include "maps_parallel.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace paradize::maps {
namespace {

std::int8_t snorm_code(float v) {
    const float scaled = (v < -1.0F ? -1.0F : (v > 1.0F ? 1.0F : v)) * 127.0F;
    return static_cast<std::int8_t>(scaled < 0.0F ? scaled - 0.5F : scaled + 0.5F);
}

// Moves up to |sum| codes of channel c by one against the sign of `sum`; returns what that adds to the sum.
std::int64_t move_codes(std::span<const float> in, std::span<std::int8_t> out, std::size_t c,
                        std::int64_t sum) {
    const int step = sum > 0 ? -1 : 1;
    // How much rounding added in the direction that is to be undone; the largest go first.
    const auto gain = [&](std::size_t i) {
        return static_cast<float>(-step) * (static_cast<float>(out[2 * i + c]) - in[2 * i + c] * 127.0F);
    };
    std::vector<std::uint32_t> order;
    order.reserve(in.size() / 2);
    for (std::size_t i = 0; i < in.size() / 2; ++i) {
        if (out[2 * i + c] != 127 * step) {
            order.push_back(static_cast<std::uint32_t>(i));
        }
    }
    const std::size_t moves = std::min(order.size(), static_cast<std::size_t>(std::abs(sum)));
    const auto first = [&](std::uint32_t a, std::uint32_t b) {
        const float ga = gain(a);
        const float gb = gain(b);
        return ga != gb ? ga > gb : a < b;
    };
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(moves), order.end(), first);
    for (std::size_t k = 0; k < moves; ++k) {
        out[2 * order[k] + c] = static_cast<std::int8_t>(out[2 * order[k] + c] + step);
    }
    return static_cast<std::int64_t>(moves) * step;
}

} // namespace

void snorm8(std::span<const float> in, std::span<std::int8_t> out, int threads) {
    for_rows(in.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            out[i] = snorm_code(in[i]);
        }
    });
}

void centred_xy(std::span<const float> normals, std::span<float> out) {
    const std::size_t count = normals.size() / 3;
    for (std::size_t c = 0; c < 2; ++c) {
        double sum = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            sum += normals[3 * i + c];
        }
        const double mean = sum / static_cast<double>(count);
        for (std::size_t i = 0; i < count; ++i) {
            out[2 * i + c] = static_cast<float>(normals[3 * i + c] - mean);
        }
    }
}

void balanced_snorm8(std::span<const float> in, std::span<std::int8_t> out) {
    const std::size_t count = in.size() / 2;
    for (std::size_t c = 0; c < 2; ++c) {
        std::int64_t sum = 0;
        for (std::size_t i = 0; i < count; ++i) {
            out[2 * i + c] = snorm_code(in[2 * i + c]);
            sum += out[2 * i + c];
        }
        // One pass is enough unless values beyond the range were cut off.
        while (sum != 0) {
            sum += move_codes(in, out, c, sum);
        }
    }
}

} // namespace paradize::maps
