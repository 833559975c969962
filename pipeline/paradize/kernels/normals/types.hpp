// Shared by the normal kernels: settings, and the table of row functions of one instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace paradize::normals {

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

// Every row function writes up to so many bytes beyond the row's end.
constexpr std::size_t slack = 256;

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

// The row functions of one instruction set.
struct Kernels {
    // Copies n floats; false when one is not finite.
    bool (*copy)(const float *from, std::size_t n, float *to);
    // to[x] = sum of left[k - 1] (line[x - k] - line[x + k]).
    void (*along)(const float *line, std::size_t n, const float *left, int reach, float *to);
    // Unit normals (x y z) of a row; false when one is too steep for float (the row is to be done in double).
    bool (*row)(const RowJob &job, float *xyz);
    // The same from slopes; both may be read for `margin` floats beyond their end.
    bool (*from_slopes)(const float *dx, const float *dy, std::size_t n, float left, float down, float *xyz);
    // Copies bytes past the caches; `fence` after the last.
    void (*stream)(std::uint8_t *to, const std::uint8_t *from, std::size_t bytes);
    void (*fence)();
};

// Those of a width that this CPU runs; nullptr where it does not.
const Kernels *kernels_of(Width width);

} // namespace paradize::normals
