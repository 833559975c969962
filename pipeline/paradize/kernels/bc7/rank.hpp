// Which partitions promise most: for each, the squared error that is left when every subset's texels lie on
// their own line, plus what coarse places along the lines leave.
#pragma once

#include "bc7/axis.hpp"
#include "bc7/effort.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// The best partitions of each block so far, best first.
struct BestPartitions {
    Lanes error[most_kept];
    IntLanes partition[most_kept];
};

PARADIZE_INLINE void clear(BestPartitions &kept, int count) {
    for (int i = 0; i < count; ++i) {
        kept.error[i] = all(1e30F);
        kept.partition[i] = IntLanes{};
    }
}

PARADIZE_INLINE void keep(BestPartitions &kept, int count, Lanes error, int partition) {
    IntLanes here = IntLanes{} + partition;
    for (int i = 0; i < count; ++i) {
        const IntLanes better = error < kept.error[i];
        const Lanes pushed = better ? kept.error[i] : error;
        const IntLanes moved = better ? kept.partition[i] : here;
        kept.error[i] = better ? error : kept.error[i];
        kept.partition[i] = better ? here : kept.partition[i];
        error = pushed;
        here = moved;
    }
}

// The texels of one subset of one partition as bits.
constexpr std::uint32_t bits_of(int subsets, int partition, int subset) {
    std::uint32_t bits = 0;
    for (int t = 0; t < texels; ++t) {
        bits |= static_cast<std::uint32_t>(subset_of(subsets, partition, t) == subset) << t;
    }
    return bits;
}

template <int Channels>
PARADIZE_INLINE void add_bits(const Block &block, const Products<Channels> &products, std::uint32_t bits,
                              Sums<Channels> &sums) {
    clear(sums);
    int count = 0;
    for (; bits != 0; bits &= bits - 1) {
        add_texel(block, products, __builtin_ctz(bits), sums);
        ++count;
    }
    sums.count = all(static_cast<float>(count));
}

// The share that 8 and that 4 places leave of the spread along a line that the texels fill evenly.
constexpr float left_fine = 1.0F / 49.0F;
constexpr float left_coarse = 1.0F / 9.0F;

// Fine: for 8 places, among the first fine_among partitions; coarse: for 4 places, among all of `among`.
template <int Subsets, int Channels>
static void rank(const Block &block, const Products<Channels> &products, int among, BestPartitions &fine,
                 int fine_count, int fine_among, BestPartitions &coarse, int coarse_count) {
    clear(fine, fine_count);
    clear(coarse, coarse_count);
    for (int partition = 0; partition < among; ++partition) {
        Lanes spread = Lanes{};
        Lanes along = Lanes{};
        Sums<Channels> rest = products.total;
        for (int s = 1; s < Subsets; ++s) {
            Sums<Channels> sums;
            add_bits(block, products, bits_of(Subsets, partition, s), sums);
            subtract(rest, sums, rest);
            Axis<Channels> axis;
            find_axis(sums, 2, axis);
            spread += axis.spread;
            along += axis.along;
        }
        Axis<Channels> axis;
        find_axis(rest, 2, axis);
        spread += axis.spread;
        along += axis.along;
        if (partition < fine_among) {
            keep(fine, fine_count, spread - along * (1.0F - left_fine), partition);
        }
        keep(coarse, coarse_count, spread - along * (1.0F - left_coarse), partition);
    }
}

// The four choices of the channel that stands alone in modes 4 and 5: its number in `partition`, as the
// rotation is written.
static void rank_alone(const Products<4> &products, BestPartitions &kept, int count) {
    clear(kept, count);
    for (int rotation = 0; rotation < 4; ++rotation) {
        const int alone = rotation == 0 ? 3 : rotation - 1;
        int from[3];
        for (int c = 0; c < 3; ++c) {
            from[c] = c < alone ? c : c + 1;
        }
        Sums<3> sums;
        sums.count = products.total.count;
        for (int k = 0; k < 3; ++k) {
            sums.value[k] = products.total.value[from[k]];
            for (int j = 0; j <= k; ++j) {
                sums.product[pair(j, k)] = products.total.product[pair(from[j], from[k])];
            }
        }
        Axis<3> axis;
        find_axis(sums, 2, axis);
        const Lanes value = products.total.value[alone];
        const Lanes single = products.total.product[pair(alone, alone)] - value * value / sums.count;
        const Lanes most = larger(axis.along, single);
        const Lanes least = smaller(axis.along, single);
        keep(kept, count, axis.spread - axis.along + most * left_fine + least * left_coarse, rotation);
    }
}

} // namespace paradize::bc7::PARADIZE_WIDTH
