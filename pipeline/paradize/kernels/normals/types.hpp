// What the normal kernels share: settings, encodings, and the table of row functions of one instruction set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace paradize::normals {

// What a row of normals is written as.
//   float3: x y z, float        rgb8: three codes 0..255, 2c/255 - 1 nearest to the value, zero is 128
//   snorm8: x y, codes -127..127, nearest, halves away from zero
//   fine:   rgb8, and beside it two bytes per texel: what is left of x and y, see fine_code
enum class Encoding { float3 = 0, rgb8 = 1, snorm8 = 2, fine = 3 };

// Instruction sets; every one gives the same bits.
enum class Width { widest = 0, baseline = 1, avx2 = 2, avx512 = 3 };

constexpr int largest_reach = 64;

// A derivative filter out of separable taps, and the slope that one unit of height makes between neighbours.
struct Settings {
    const double *derivative; // reach weights of h[+k] - h[-k], k = 1, 2, ... along the axis
    int reach;                // 1 .. largest_reach
    const double *smooth;     // across + 1 weights of the centre and of both neighbours at 1, 2, ...
    int across;               // 0 .. largest_reach
    double scale_x;
    double scale_y;
    bool wrap_x;
    bool wrap_y;
    bool green_down;
};

// Sums of the fine codes of some texels: of code >> 8, the smallest and the largest, for x and y.
struct FineSums {
    std::int64_t whole[2] = {0, 0};
    std::int32_t low[2] = {std::numeric_limits<std::int32_t>::max(),
                           std::numeric_limits<std::int32_t>::max()};
    std::int32_t high[2] = {std::numeric_limits<std::int32_t>::min(),
                            std::numeric_limits<std::int32_t>::min()};

    void add(const FineSums &other) {
        for (int c = 0; c < 2; ++c) {
            whole[c] += other.whole[c];
            low[c] = other.low[c] < low[c] ? other.low[c] : low[c];
            high[c] = other.high[c] > high[c] ? other.high[c] : high[c];
        }
    }
};

// Low bytes of fine codes are counted in so many levels.
constexpr std::size_t levels = 8;
constexpr std::size_t level_step = 256 / levels;

// Where a row goes. Every function writes up to `slack` bytes beyond the row's end.
constexpr std::size_t slack = 256;
struct RowOut {
    void *codes;
    std::uint8_t *fine; // 2 per texel, for Encoding::fine
    FineSums *sums;     // added to, for Encoding::fine
};

// One row of heights with its neighbours. lines[j], j = -max(reach, across) .. +that: the row j further down,
// column 0 first, extended on both sides by as many columns and readable for `margin` more.
constexpr std::size_t margin = 64;
struct RowJob {
    const float *const *lines;
    const float *const *along; // along[j], j = -across .. across: sum of left[k] (h[-k] - h[+k]) of that row
    float *scratch;            // a row as long as lines[0], extended alike
    std::size_t columns;
    const float *left; // reach weights times the scale along x
    const float *down; // reach weights times the scale along y
    const float *smooth;
    int reach;
    int across;
};

// Levels without their gamma: ((v - black) / range clamped - 1/2) contrast + 1/2 + brightness, clamped.
struct Linear {
    double black;
    double range;
    double contrast;
    double brightness;
    bool invert;
};

// The row functions of one instruction set.
struct Kernels {
    // Copies n floats; false when one is not finite.
    bool (*copy)(const float *from, std::size_t n, float *to);
    // to[x] = sum of left[k - 1] (line[x - k] - line[x + k]).
    void (*along)(const float *line, std::size_t n, const float *left, int reach, float *to);
    // Slopes and normals of a row; false when one is too steep for float (the row is to be done in double).
    bool (*row)(const RowJob &job, Encoding encoding, const RowOut &out);
    // The same from slopes; both may be read for `margin` floats beyond their end.
    bool (*from_slopes)(const float *dx, const float *dy, std::size_t n, float left, float down,
                        Encoding encoding, const RowOut &out);
    // to = levels of the values.
    void (*levels)(const float *values, std::size_t n, const Linear &levels, float *to);
    // Heights 0..1 -> 65535 h, nearest, two bytes each.
    void (*height_codes)(const float *heights, std::size_t n, std::uint8_t *to);
    // Two codes 0..255 of low + t (high - low), nearest, for each of n values t.
    void (*gloss_codes)(const float *t, std::size_t n, const float *low, const float *step, std::uint8_t *to);
    // counts[levels c + k] += how many of the n texels have fine[2 i + c] >= level_step k.
    void (*count_levels)(const std::uint8_t *fine, std::size_t n, std::uint32_t *counts);
    // (the fine codes that rgb and rest, 2 per texel, hold + shift[c]) >> 8; where the byte shifted out is
    // 240 or above the first more[c] are one higher. `to` may be `rest`.
    void (*shifted_codes)(const std::uint8_t *rgb, const std::uint8_t *rest, std::size_t n,
                          const std::int32_t *shift, std::uint32_t *more, std::uint8_t *to);
    // Copies bytes past the caches; `fence` after the last.
    void (*stream)(std::uint8_t *to, const std::uint8_t *from, std::size_t bytes);
    void (*fence)();
};

// Those of a width that this CPU runs; nullptr where it does not.
const Kernels *kernels_of(Width width);

} // namespace paradize::normals
