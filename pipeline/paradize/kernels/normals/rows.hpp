// Rows of normals, compiled once per instruction set: include after defining PARADIZE_WIDTH and
// PARADIZE_LANES.
#pragma once

#include "normals/lanes.hpp"
#include "normals/types.hpp"

namespace paradize::normals::PARADIZE_WIDTH {

// (slope^2 + 1) beyond which float is not enough, as bits: they order like the values, with infinity and
// every NaN above.
constexpr std::uint32_t steep_bits = 0x7b4097ceU; // 1e36

static bool copy(const float *from, std::size_t n, float *to) {
    Bits worst = {};
    std::size_t x = 0;
    for (; x + lanes <= n; x += lanes) {
        const Lanes v = load(from + x);
        // Two pages ahead: the hardware looks no further than the end of one.
        __builtin_prefetch(reinterpret_cast<const void *>(reinterpret_cast<std::uintptr_t>(from + x) + 8192));
        const Bits bits = (Bits)v & 0x7fffffffU;
        worst = bits > worst ? bits : worst;
        store(to + x, v);
    }
    std::uint32_t most = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
        most = worst[i] > most ? worst[i] : most;
    }
    for (; x < n; ++x) {
        std::uint32_t bits;
        std::memcpy(&bits, from + x, 4);
        bits &= 0x7fffffffU;
        most = bits > most ? bits : most;
        to[x] = from[x];
    }
    return most < 0x7f800000U;
}

// Weighted differences along a line, the nearest first.
template <int fixed_reach>
PARADIZE_INLINE Lanes along_at(const float *line, const float *left, int reach) {
    const int taps = fixed_reach > 0 ? fixed_reach : reach;
    Lanes sum = left[0] * (load(line - 1) - load(line + 1));
    for (int k = 2; k <= taps; ++k) {
        sum += left[k - 1] * (load(line - k) - load(line + k));
    }
    return sum;
}

template <int fixed_reach>
PARADIZE_INLINE Lanes down_at(const float *const *lines, std::ptrdiff_t x, const float *down, int reach) {
    const int taps = fixed_reach > 0 ? fixed_reach : reach;
    Lanes sum = down[0] * (load(lines[1] + x) - load(lines[-1] + x));
    for (int k = 2; k <= taps; ++k) {
        sum += down[k - 1] * (load(lines[k] + x) - load(lines[-k] + x));
    }
    return sum;
}

static void along(const float *line, std::size_t n, const float *left, int reach, float *to) {
    for (std::size_t x = 0; x < n; x += lanes) {
        store(to + x, along_at<0>(line + x, left, reach));
    }
}

// The slopes of a row as x and y of its normals before they have length 1. reach 0: any taps, out of
// job.along and job.scratch.
template <int reach, int across>
struct Taps {
    const RowJob &job;

    explicit Taps(const RowJob &wanted) : job(wanted) {
        if constexpr (reach == 0) {
            const auto end = static_cast<std::ptrdiff_t>(job.columns) + job.across;
            for (std::ptrdiff_t x = -job.across; x < end; x += static_cast<std::ptrdiff_t>(lanes)) {
                store(job.scratch + x, down_at<0>(job.lines, x, job.down, job.reach));
            }
        }
    }

    __attribute__((always_inline)) inline void at(std::size_t column, Lanes &nx, Lanes &ny) const {
        const auto x = static_cast<std::ptrdiff_t>(column);
        if constexpr (reach == 0) {
            nx = job.smooth[0] * load(job.along[0] + x);
            ny = job.smooth[0] * load(job.scratch + x);
            for (int j = 1; j <= job.across; ++j) {
                nx += job.smooth[j] * (load(job.along[-j] + x) + load(job.along[j] + x));
                ny += job.smooth[j] * (load(job.scratch + x - j) + load(job.scratch + x + j));
            }
        } else if constexpr (across == 0) {
            nx = job.smooth[0] * along_at<reach>(job.lines[0] + x, job.left, reach);
            ny = job.smooth[0] * down_at<reach>(job.lines, x, job.down, reach);
        } else {
            nx = job.smooth[0] * along_at<reach>(job.lines[0] + x, job.left, reach) +
                 job.smooth[1] * (along_at<reach>(job.lines[-1] + x, job.left, reach) +
                                  along_at<reach>(job.lines[1] + x, job.left, reach));
            ny = job.smooth[0] * down_at<reach>(job.lines, x, job.down, reach) +
                 job.smooth[1] * (down_at<reach>(job.lines, x - 1, job.down, reach) +
                                  down_at<reach>(job.lines, x + 1, job.down, reach));
        }
    }
};

struct GivenSlopes {
    const float *dx;
    const float *dy;
    float left;
    float down;

    __attribute__((always_inline)) inline void at(std::size_t x, Lanes &nx, Lanes &ny) const {
        nx = left * load(dx + x);
        ny = down * load(dy + x);
    }
};

struct Writer {
    explicit Writer(float *to) : xyz(to) {}

    float *xyz;
    Bits worst = {};

    // all: every lane is a texel; else those that `keep` says.
    template <bool all>
    __attribute__((always_inline)) inline void put(std::size_t x, const Lanes &nx, const Lanes &ny,
                                                   const IntLanes &keep) {
        const Lanes square = nx * nx + ny * ny + 1.0F;
        const Bits bits = all ? (Bits)square : (Bits)square & (Bits)keep;
        worst = bits > worst ? bits : worst;
        const Lanes inverse = 1.0F / root(square);
        store_xyz(xyz + 3 * x, nx * inverse + 0.0F, ny * inverse + 0.0F, inverse);
    }

    // Inlined, so that nobody else knows the address of what is summed up, and it stays in registers.
    __attribute__((always_inline)) inline bool end() const {
        std::uint32_t most = 0;
        for (std::size_t i = 0; i < lanes; ++i) {
            most = worst[i] > most ? worst[i] : most;
        }
        return most <= steep_bits;
    }
};

template <typename Slopes>
static bool run_row(const Slopes &slopes, std::size_t columns, float *xyz) {
    Writer writer(xyz);
    Lanes nx;
    Lanes ny;
    std::size_t x = 0;
    for (; x + lanes <= columns; x += lanes) {
        slopes.at(x, nx, ny);
        writer.template put<true>(x, nx, ny, IntLanes{});
    }
    if (x < columns) {
        slopes.at(x, nx, ny);
        writer.template put<false>(x, nx, ny, first_lanes(columns - x));
    }
    return writer.end();
}

template <int across>
static bool by_reach(const RowJob &job, float *xyz) {
    switch (job.reach) {
    case 1:
        return run_row(Taps<1, across>(job), job.columns, xyz);
    case 2:
        return run_row(Taps<2, across>(job), job.columns, xyz);
    case 3:
        return run_row(Taps<3, across>(job), job.columns, xyz);
    default:
        return run_row(Taps<4, across>(job), job.columns, xyz);
    }
}

static bool row(const RowJob &job, float *xyz) {
    if (job.reach > 4 || job.across > 1) {
        return run_row(Taps<0, 0>(job), job.columns, xyz);
    }
    return job.across == 0 ? by_reach<0>(job, xyz) : by_reach<1>(job, xyz);
}

static bool from_slopes(const float *dx, const float *dy, std::size_t n, float left, float down, float *xyz) {
    return run_row(GivenSlopes{dx, dy, left, down}, n, xyz);
}

const Kernels *kernels() {
    static constexpr Kernels table{&copy, &along, &row, &from_slopes, &stream, &fence};
    return &table;
}

} // namespace paradize::normals::PARADIZE_WIDTH
