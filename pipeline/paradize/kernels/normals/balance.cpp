#include "normals/balance.hpp"

#include <algorithm>

#include "normals/codes.hpp"

namespace paradize::normals {
namespace {

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
    return a / b - (a % b < 0 ? 1 : 0);
}

std::int32_t cut(std::int32_t code) {
    return std::clamp(code, -127, 127);
}

} // namespace

Shift balance(const FineCounts &counts, std::size_t columns, std::size_t channel) {
    const std::size_t rows = counts.levels.size() / (2 * levels);
    const auto at = [&](std::size_t row, std::size_t k) -> std::int64_t {
        return k == levels ? 0 : counts.levels[(2 * row + channel) * levels + k];
    };
    std::int64_t total[levels + 1] = {};
    for (std::size_t row = 0; row < rows; ++row) {
        for (std::size_t k = 0; k < levels; ++k) {
            total[k] += at(row, k);
        }
    }
    // With a shift of 256 t + step s the codes sum to whole + n t + (how many have a low byte of 256 - step s
    // or above). The largest shift whose sum is not above zero:
    const auto n = static_cast<std::int64_t>(rows * columns);
    const std::int64_t t = floor_divide(-counts.sums.whole[channel], n);
    const std::int64_t base = counts.sums.whole[channel] + n * t;
    std::size_t s = 0;
    while (s + 1 < levels && base + total[levels - s - 1] <= 0) {
        ++s;
    }
    const std::int64_t missing = -(base + total[levels - s]);
    Shift shift;
    shift.by = static_cast<std::int32_t>(256 * t + static_cast<std::int64_t>(level_step * s));
    const std::int32_t highest = ((counts.sums.high[channel] + shift.by) >> 8) + (missing > 0 ? 1 : 0);
    if (highest > 127 || ((counts.sums.low[channel] + shift.by) >> 8) < -127) {
        shift.cut_off = true;
        return shift;
    }
    // The next larger shift raises the texels of one level, more than are missing: a share of each row's.
    const std::int64_t raised = total[levels - s - 1] - total[levels - s];
    shift.more.resize(rows);
    std::int64_t before = 0;
    std::int64_t given = 0;
    for (std::size_t row = 0; row < rows && missing > 0; ++row) {
        before += at(row, levels - s - 1) - at(row, levels - s);
        const std::int64_t due = before * missing / raised;
        shift.more[row] = static_cast<std::uint32_t>(due - given);
        given = due;
    }
    return shift;
}

void balance_cut_off(const std::uint8_t *normal, std::uint8_t *dudv, std::size_t texels,
                     std::size_t channel) {
    constexpr std::int32_t bottom = -256 * 128;
    std::vector<std::int64_t> found(256 * 257);
    const auto fine = [&](std::size_t i) {
        return fine_code(normal[3 * i + channel], dudv[2 * i + channel]);
    };
    for (std::size_t i = 0; i < texels; ++i) {
        ++found[static_cast<std::size_t>(fine(i) - bottom)];
    }
    const auto sum_of = [&](std::int32_t shift) {
        std::int64_t sum = 0;
        for (std::size_t v = 0; v < found.size(); ++v) {
            sum += found[v] * cut((static_cast<std::int32_t>(v) + bottom + shift) >> 8);
        }
        return sum;
    };
    // The sum grows with the shift: the largest one whose sum is not above zero.
    std::int32_t low = 2 * bottom;
    std::int32_t high = -2 * bottom;
    while (high - low > 1) {
        const std::int32_t middle = low + (high - low) / 2;
        (sum_of(middle) <= 0 ? low : high) = middle;
    }
    std::int64_t missing = -sum_of(low);
    for (std::size_t i = 0; i < texels; ++i) {
        const std::int32_t moved = fine(i) + low;
        std::int32_t code = cut(moved >> 8);
        if (missing > 0 && cut((moved + 1) >> 8) > code) {
            ++code;
            --missing;
        }
        dudv[2 * i + channel] = static_cast<std::uint8_t>(code);
    }
}

} // namespace paradize::normals
