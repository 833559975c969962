// Sums over the texels of a subset, and the line through them that leaves the least: principal axis after
// K. Pearson, "On lines and planes of closest fit" (1901), by power iteration.
#pragma once

#include "bc7/lanes.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

constexpr int pairs(int channels) {
    return channels * (channels + 1) / 2;
}

// The place of channels j <= k in a packed symmetric matrix.
constexpr int pair(int j, int k) {
    return k * (k + 1) / 2 + j;
}

// Sums of the values and of the products of two channels: exact, being integers below 2^24.
template <int Channels>
struct Sums {
    Lanes count;
    Lanes value[Channels];
    Lanes product[pairs(Channels)];
};

// The products of every texel, made once for the many subsets that add them up.
template <int Channels>
struct Products {
    Lanes of[texels][pairs(Channels)];
    Sums<Channels> total;
};

template <int Channels>
PARADIZE_INLINE void clear(Sums<Channels> &sums) {
    sums.count = Lanes{};
    for (int c = 0; c < Channels; ++c) {
        sums.value[c] = Lanes{};
    }
    for (int i = 0; i < pairs(Channels); ++i) {
        sums.product[i] = Lanes{};
    }
}

template <int Channels>
PARADIZE_INLINE void add_texel(const Block &block, const Products<Channels> &products, int t,
                               Sums<Channels> &sums) {
    for (int c = 0; c < Channels; ++c) {
        sums.value[c] += block.v[c][t];
    }
    for (int i = 0; i < pairs(Channels); ++i) {
        sums.product[i] += products.of[t][i];
    }
}

// Adds texel t where member says so.
template <int Channels>
PARADIZE_INLINE void add_member(const Block &block, const Products<Channels> &products, int t,
                                const IntLanes &member, Sums<Channels> &sums) {
    sums.count += member ? all(1.0F) : Lanes{};
    for (int c = 0; c < Channels; ++c) {
        sums.value[c] += member ? block.v[c][t] : Lanes{};
    }
    for (int i = 0; i < pairs(Channels); ++i) {
        sums.product[i] += member ? products.of[t][i] : Lanes{};
    }
}

template <int Channels>
PARADIZE_INLINE void subtract(const Sums<Channels> &a, const Sums<Channels> &b, Sums<Channels> &out) {
    out.count = a.count - b.count;
    for (int c = 0; c < Channels; ++c) {
        out.value[c] = a.value[c] - b.value[c];
    }
    for (int i = 0; i < pairs(Channels); ++i) {
        out.product[i] = a.product[i] - b.product[i];
    }
}

template <int Channels>
PARADIZE_INLINE void make_products(const Block &block, Products<Channels> &out) {
    clear(out.total);
    out.total.count = all(static_cast<float>(texels));
    for (int t = 0; t < texels; ++t) {
        for (int k = 0; k < Channels; ++k) {
            for (int j = 0; j <= k; ++j) {
                out.of[t][pair(j, k)] = block.v[j][t] * block.v[k][t];
            }
        }
        add_texel(block, out, t, out.total);
    }
}

// Squared distances from the mean, summed, and what part of them lies along the axis. The axis has no fixed
// length; all is zero where the texels are one colour.
template <int Channels>
struct Axis {
    Lanes spread;
    Lanes along;
    Lanes direction[Channels];
};

template <int Channels>
PARADIZE_INLINE void find_axis(const Sums<Channels> &sums, int turns, Axis<Channels> &out) {
    const Lanes share = 1.0F / sums.count;
    Lanes matrix[pairs(Channels)];
    for (int k = 0; k < Channels; ++k) {
        for (int j = 0; j <= k; ++j) {
            matrix[pair(j, k)] = sums.product[pair(j, k)] - sums.value[j] * sums.value[k] * share;
        }
    }
    out.spread = matrix[0];
    for (int k = 1; k < Channels; ++k) {
        out.spread += matrix[pair(k, k)];
    }
    const Lanes unit = out.spread > 0.01F ? 1.0F / out.spread : Lanes{};
    for (int i = 0; i < pairs(Channels); ++i) {
        matrix[i] *= unit;
    }
    // Start from the row of the channel that varies most.
    Lanes most = matrix[0];
    for (int c = 0; c < Channels; ++c) {
        out.direction[c] = matrix[pair(0, c)];
    }
    for (int k = 1; k < Channels; ++k) {
        const IntLanes wider = matrix[pair(k, k)] > most;
        most = wider ? matrix[pair(k, k)] : most;
        for (int c = 0; c < Channels; ++c) {
            out.direction[c] = wider ? matrix[c < k ? pair(c, k) : pair(k, c)] : out.direction[c];
        }
    }
    Lanes last = Lanes{};
    Lanes next = Lanes{};
    for (int turn = 0; turn < turns; ++turn) {
        Lanes image[Channels];
        last = Lanes{};
        next = Lanes{};
        for (int k = 0; k < Channels; ++k) {
            image[k] = matrix[pair(0, k)] * out.direction[0];
            for (int j = 1; j < Channels; ++j) {
                image[k] += matrix[j < k ? pair(j, k) : pair(k, j)] * out.direction[j];
            }
            last += out.direction[k] * image[k];
            next += image[k] * image[k];
        }
        for (int k = 0; k < Channels; ++k) {
            out.direction[k] = image[k];
        }
    }
    out.along = last > 1e-20F ? out.spread * (next / last) : Lanes{};
}

} // namespace paradize::bc7::PARADIZE_WIDTH
