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

// i - i / 2^n, rounded down. Of rows that are too steep i is anything, so that it must wrap around.
PARADIZE_INLINE Bits less_part(const Whole &i, int n) {
    return (Bits)i + (Bits)((Whole)(0U - (Bits)i) >> n);
}

// floor(127.5 v) + 128 of v 2^30; see normals/codes.hpp.
PARADIZE_INLINE Bits unorm_codes(const Whole &i) {
    return (less_part(i, 8) + (1U << 30)) >> 23;
}

PARADIZE_INLINE Whole fine_codes(const Whole &i) {
    return (Whole)(less_part(i, 7) + (1U << 14)) >> 15;
}

// 127 v of v 2^30, nearest. -|v| 2^31 is a whole number for every v up to 1, and beyond 1 becomes that of 1.
PARADIZE_INLINE Whole snorm_codes(const Lanes &v) {
    const Whole negative = (Whole)v >> 31;
    const Lanes below = (Lanes)((Bits)v | 0x80000000U);
    const Lanes limit = Lanes{} - 0x1p30F;
    const Whole n = __builtin_convertvector((below < limit ? limit : below) * 2.0F, Whole);
    const Whole code = ((n >> 7) - n + (1 << 23)) >> 24;
    return (code ^ negative) - negative;
}

struct FineLanes {
    Whole whole = {};
    Whole low = Whole{} + std::numeric_limits<std::int32_t>::max();
    Whole high = Whole{} + std::numeric_limits<std::int32_t>::min();

    template <bool all>
    __attribute__((always_inline)) inline void add(const Whole &code, const Whole &keep) {
        if constexpr (all) {
            whole += code >> 8;
            low = code < low ? code : low;
            high = code > high ? code : high;
        } else {
            whole += (code >> 8) & keep;
            const Whole lower = keep & (code < low);
            low = lower ? code : low;
            const Whole higher = keep & (code > high);
            high = higher ? code : high;
        }
    }

    __attribute__((always_inline)) inline void into(FineSums &sums, int channel) const {
        for (std::size_t i = 0; i < lanes; ++i) {
            sums.whole[channel] += whole[i];
            sums.low[channel] = low[i] < sums.low[channel] ? low[i] : sums.low[channel];
            sums.high[channel] = high[i] > sums.high[channel] ? high[i] : sums.high[channel];
        }
    }
};

template <Encoding encoding>
struct Writer {
    explicit Writer(const RowOut &wanted) : out(wanted) {}

    const RowOut out;
    Bits worst = {};
    FineLanes fine[encoding == Encoding::fine ? 2 : 1];

    // all: every lane is a texel; else those that `keep` says.
    template <bool all>
    __attribute__((always_inline)) inline void put(std::size_t x, const Lanes &nx, const Lanes &ny,
                                                   const Whole &keep) {
        const Lanes square = nx * nx + ny * ny + 1.0F;
        const Bits bits = all ? (Bits)square : (Bits)square & (Bits)keep;
        worst = bits > worst ? bits : worst;
        const Lanes inverse = 1.0F / root(square);
        if constexpr (encoding == Encoding::float3) {
            store_xyz(static_cast<float *>(out.codes) + 3 * x, nx * inverse + 0.0F, ny * inverse + 0.0F,
                      inverse);
            return;
        }
        const Lanes scaled = inverse * 0x1p30F; // exact: what follows are the float's own bits
        const Lanes x30 = nx * scaled;
        const Lanes y30 = ny * scaled;
        auto *codes = static_cast<std::uint8_t *>(out.codes);
        if constexpr (encoding == Encoding::snorm8) {
            store_pairs(codes + 2 * x, ((Bits)snorm_codes(x30) & 255U) | ((Bits)snorm_codes(y30) << 8));
            return;
        }
        const Whole ix = __builtin_convertvector(x30, Whole);
        const Whole iy = __builtin_convertvector(y30, Whole);
        const Whole iz = __builtin_convertvector(scaled, Whole);
        store_rgb(codes + 3 * x, unorm_codes(ix) | unorm_codes(iy) << 8 | unorm_codes(iz) << 16);
        if constexpr (encoding == Encoding::fine) {
            const Whole fx = fine_codes(ix);
            const Whole fy = fine_codes(iy);
            fine[0].template add<all>(fx, keep);
            fine[1].template add<all>(fy, keep);
            store_pairs(out.fine + 2 * x, ((Bits)fx & 255U) | ((Bits)fy << 8));
        }
    }

    // Inlined, so that nobody else knows the address of what is summed up, and it stays in registers.
    __attribute__((always_inline)) inline bool end() const {
        std::uint32_t most = 0;
        for (std::size_t i = 0; i < lanes; ++i) {
            most = worst[i] > most ? worst[i] : most;
        }
        if constexpr (encoding == Encoding::fine) {
            fine[0].into(*out.sums, 0);
            fine[1].into(*out.sums, 1);
        }
        return most <= steep_bits;
    }
};

template <Encoding encoding, typename Slopes>
static bool run_row(const Slopes &slopes, std::size_t columns, const RowOut &out) {
    Writer<encoding> writer(out);
    Lanes nx;
    Lanes ny;
    std::size_t x = 0;
    for (; x + lanes <= columns; x += lanes) {
        slopes.at(x, nx, ny);
        writer.template put<true>(x, nx, ny, Whole{});
    }
    if (x < columns) {
        slopes.at(x, nx, ny);
        writer.template put<false>(x, nx, ny, first_lanes(columns - x));
    }
    return writer.end();
}

template <typename Slopes>
static bool any_encoding(const Slopes &slopes, std::size_t columns, Encoding encoding, const RowOut &out) {
    switch (encoding) {
    case Encoding::float3:
        return run_row<Encoding::float3>(slopes, columns, out);
    case Encoding::rgb8:
        return run_row<Encoding::rgb8>(slopes, columns, out);
    case Encoding::snorm8:
        return run_row<Encoding::snorm8>(slopes, columns, out);
    default:
        return run_row<Encoding::fine>(slopes, columns, out);
    }
}

template <int across>
static bool by_reach(const RowJob &job, Encoding encoding, const RowOut &out) {
    switch (job.reach) {
    case 1:
        return any_encoding(Taps<1, across>(job), job.columns, encoding, out);
    case 2:
        return any_encoding(Taps<2, across>(job), job.columns, encoding, out);
    case 3:
        return any_encoding(Taps<3, across>(job), job.columns, encoding, out);
    default:
        return any_encoding(Taps<4, across>(job), job.columns, encoding, out);
    }
}

static bool row(const RowJob &job, Encoding encoding, const RowOut &out) {
    if (job.reach > 4 || job.across > 1) {
        return any_encoding(Taps<0, 0>(job), job.columns, encoding, out);
    }
    return job.across == 0 ? by_reach<0>(job, encoding, out) : by_reach<1>(job, encoding, out);
}

static bool from_slopes(const float *dx, const float *dy, std::size_t n, float left, float down,
                        Encoding encoding, const RowOut &out) {
    return any_encoding(GivenSlopes{dx, dy, left, down}, n, encoding, out);
}

} // namespace paradize::normals::PARADIZE_WIDTH
