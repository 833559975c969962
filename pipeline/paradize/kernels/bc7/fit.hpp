// Ends and indices of a block's subsets in one mode: start from the principal axis, round the ends to the
// mode's codes, give every texel its nearest place, refit the ends by least squares (after S. Brown's
// description of "squish", 2006), and repeat.
#pragma once

#include "bc7/axis.hpp"
#include "bc7/codes.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// Which texels belong to subset 1 and to subset 2; the others belong to subset 0.
template <int Subsets>
struct Members {
    IntLanes of[Subsets > 1 ? Subsets - 1 : 1][texels];
};

// The error of each channel: squared errors, summed, and the largest difference of a texel.
template <int Channels>
struct ChannelErrors {
    Lanes square[Channels];
    Lanes worst[Channels];
};

// The best fit of a block: codes of the ends, with their low bits, and every texel's index.
template <int Channels, int Subsets>
struct BlockFit {
    Lanes error; // weighted
    ChannelErrors<Channels> left;
    Endpoints<Channels> code[Subsets];
    Lanes index[texels];
};

// Sums over a subset's texels of their weights 0..64, the squares, and the products with the values.
template <int Channels>
struct LeastSquaresSums {
    Lanes weight;
    Lanes square;
    Lanes value[Channels];
};

// A subset's ends, ready to place texels between them.
template <int Channels>
struct Ramp {
    Lanes slope[Channels]; // value -> index
    Lanes shift;
    Lanes base[Channels];
    Lanes step[Channels];
};

template <typename S>
PARADIZE_INLINE void make_ramp(const Endpoints<S::Channels> &code, const Lanes *weight,
                               Ramp<S::Channels> &ramp) {
    Lanes length = Lanes{};
    Lanes a[S::Channels];
    for (int c = 0; c < S::Channels; ++c) {
        a[c] = value_of<S::Bits>(code.a[c]);
        ramp.slope[c] = value_of<S::Bits>(code.b[c]) - a[c];
        const Lanes square = ramp.slope[c] * ramp.slope[c];
        length += weight != nullptr ? square * weight[c] : square;
    }
    const Lanes scale = length > 0.5F ? static_cast<float>(S::Steps) / length : Lanes{};
    ramp.shift = Lanes{};
    for (int c = 0; c < S::Channels; ++c) {
        // The hardware's (64 a + w (b - a) + 32) >> 6: all sixty-fourths, and the 1/128 makes ties go up.
        ramp.base[c] = a[c] + 1.0F / 128.0F;
        ramp.step[c] = ramp.slope[c] * (1.0F / 64.0F);
        ramp.slope[c] *= weight != nullptr ? scale * weight[c] : scale;
        ramp.shift -= a[c] * ramp.slope[c];
    }
}

// The index of every texel and exactly what is left in the hardware's picture.
template <typename S>
PARADIZE_INLINE void place(const Lanes (*const *values)[texels], const Lanes *weight,
                           const Members<S::Subsets> &members, const Endpoints<S::Channels> *code,
                           Lanes *index, ChannelErrors<S::Channels> &left,
                           LeastSquaresSums<S::Channels> *weighed) {
    constexpr int C = S::Channels;
    Ramp<C> ramps[S::Subsets];
    for (int s = 0; s < S::Subsets; ++s) {
        make_ramp<S>(code[s], weight, ramps[s]);
        weighed[s].weight = weighed[s].square = Lanes{};
        for (int c = 0; c < C; ++c) {
            weighed[s].value[c] = Lanes{};
        }
    }
    for (int c = 0; c < C; ++c) {
        left.square[c] = left.worst[c] = Lanes{};
    }
    for (int t = 0; t < texels; ++t) {
        Ramp<C> ramp = ramps[0];
        for (int s = 1; s < S::Subsets; ++s) {
            const IntLanes member = members.of[s - 1][t];
            ramp.shift = member ? ramps[s].shift : ramp.shift;
            for (int c = 0; c < C; ++c) {
                ramp.slope[c] = member ? ramps[s].slope[c] : ramp.slope[c];
                ramp.base[c] = member ? ramps[s].base[c] : ramp.base[c];
                ramp.step[c] = member ? ramps[s].step[c] : ramp.step[c];
            }
        }
        Lanes along = ramp.shift;
        for (int c = 0; c < C; ++c) {
            along += (*values[c])[t] * ramp.slope[c];
        }
        index[t] = nearest(clamped(along, static_cast<float>(S::Steps)));
        const Lanes part = nearest(index[t] * (64.0F / static_cast<float>(S::Steps)));
        for (int c = 0; c < C; ++c) {
            const Lanes off = (*values[c])[t] - nearest(ramp.base[c] + ramp.step[c] * part);
            const Lanes square = off * off;
            left.square[c] += square;
            left.worst[c] = larger(left.worst[c], square);
        }
        Lanes others = part;
        for (int s = 1; s < S::Subsets; ++s) {
            const Lanes mine = members.of[s - 1][t] ? part : Lanes{};
            others -= mine;
            weighed[s].weight += mine;
            weighed[s].square += mine * mine;
            for (int c = 0; c < C; ++c) {
                weighed[s].value[c] += mine * (*values[c])[t];
            }
        }
        weighed[0].weight += others;
        weighed[0].square += others * others;
        for (int c = 0; c < C; ++c) {
            weighed[0].value[c] += others * (*values[c])[t];
        }
    }
}

// The ends that fit a subset's texels best where they now lie, and what leaving them costs. Where all texels
// lie at one place the ends stay.
template <int Channels>
PARADIZE_INLINE void refit(const Lanes &count, const Lanes *value, const LeastSquaresSums<Channels> &sums,
                           Endpoints<Channels> &wanted, Cost &cost) {
    const Lanes determinant = count * sums.square - sums.weight * sums.weight;
    const IntLanes known = determinant > 0.5F;
    const Lanes share = known ? 1.0F / determinant : Lanes{};
    for (int c = 0; c < Channels; ++c) {
        const Lanes slope = (count * sums.value[c] - sums.weight * value[c]) * share;
        const Lanes a = (sums.square * value[c] - sums.weight * sums.value[c]) * share;
        wanted.a[c] = known ? a : wanted.a[c];
        wanted.b[c] = known ? a + 64.0F * slope : wanted.b[c];
    }
    const Lanes first = sums.weight * (1.0F / 64.0F);
    const Lanes second = sums.square * (1.0F / 4096.0F);
    cost.aa = count - 2.0F * first + second;
    cost.ab = first - second;
    cost.bb = second;
}

// The first ends: the outermost texels along a subset's axis. member: null where all texels are the subset's.
template <int Channels>
PARADIZE_CALLED void first_ends(const Lanes (*const *values)[texels], const IntLanes *member,
                                const Sums<Channels> &sums, Endpoints<Channels> &ends) {
    Axis<Channels> axis;
    find_axis(sums, 4, axis);
    const Lanes share = 1.0F / sums.count;
    Lanes mean[Channels];
    Lanes length = Lanes{};
    Lanes middle = Lanes{};
    for (int c = 0; c < Channels; ++c) {
        mean[c] = sums.value[c] * share;
        length += axis.direction[c] * axis.direction[c];
        middle += axis.direction[c] * mean[c];
    }
    Lanes least = middle;
    Lanes most = middle;
    for (int t = 0; t < texels; ++t) {
        Lanes along = (*values[0])[t] * axis.direction[0];
        for (int c = 1; c < Channels; ++c) {
            along += (*values[c])[t] * axis.direction[c];
        }
        if (member != nullptr) {
            along = member[t] ? along : middle;
        }
        least = smaller(least, along);
        most = larger(most, along);
    }
    const Lanes scale = length > 1e-12F ? 1.0F / length : Lanes{};
    const Lanes from = (least - middle) * scale;
    const Lanes to = (most - middle) * scale;
    for (int c = 0; c < Channels; ++c) {
        ends.a[c] = mean[c] + axis.direction[c] * from;
        ends.b[c] = mean[c] + axis.direction[c] * to;
    }
}

// Refines the ends `passes` times and keeps the best that was seen and that `allowed(left)` lets pass.
template <typename S, typename Allowed>
PARADIZE_INLINE void fit(const Lanes (*const *values)[texels], const Lanes *weight,
                         const Members<S::Subsets> &members, const Sums<S::Channels> *sums,
                         Endpoints<S::Channels> *wanted, int passes, Allowed &&allowed,
                         BlockFit<S::Channels, S::Subsets> &best) {
    constexpr int C = S::Channels;
    Endpoints<C> code[S::Subsets];
    Cost cost[S::Subsets];
    for (int s = 0; s < S::Subsets; ++s) {
        cost[s] = {all(1.0F), Lanes{}, all(1.0F)};
    }
    best.error = all(1e30F);
    for (int c = 0; c < C; ++c) {
        best.left.square[c] = best.left.worst[c] = Lanes{};
    }
    for (int s = 0; s < S::Subsets; ++s) {
        for (int c = 0; c < C; ++c) {
            best.code[s].a[c] = best.code[s].b[c] = Lanes{};
        }
    }
    for (int t = 0; t < texels; ++t) {
        best.index[t] = Lanes{};
    }
    for (int pass = 0;; ++pass) {
        for (int s = 0; s < S::Subsets; ++s) {
            round_to_codes<S>(wanted[s], weight, cost[s], code[s]);
        }
        Lanes index[texels];
        ChannelErrors<C> left;
        LeastSquaresSums<C> weighed[S::Subsets];
        place<S>(values, weight, members, code, index, left, weighed);
        Lanes error = Lanes{};
        for (int c = 0; c < C; ++c) {
            error += weight != nullptr ? left.square[c] * weight[c] : left.square[c];
        }
        const IntLanes better = (error < best.error) & allowed(left);
        best.error = better ? error : best.error;
        for (int c = 0; c < C; ++c) {
            best.left.square[c] = better ? left.square[c] : best.left.square[c];
            best.left.worst[c] = better ? left.worst[c] : best.left.worst[c];
        }
        for (int s = 0; s < S::Subsets; ++s) {
            for (int c = 0; c < C; ++c) {
                best.code[s].a[c] = better ? code[s].a[c] : best.code[s].a[c];
                best.code[s].b[c] = better ? code[s].b[c] : best.code[s].b[c];
            }
        }
        for (int t = 0; t < texels; ++t) {
            best.index[t] = better ? index[t] : best.index[t];
        }
        if (pass >= passes) {
            return;
        }
        for (int s = 0; s < S::Subsets; ++s) {
            refit<C>(sums[s].count, sums[s].value, weighed[s], wanted[s], cost[s]);
        }
    }
}

} // namespace paradize::bc7::PARADIZE_WIDTH
