// The modes' trials for the blocks of one vector; whatever is best so far stands in Best.
#pragma once

#include "bc7/effort.hpp"
#include "bc7/fit.hpp"
#include "bc7/rank.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// The squared errors of a block's channels, or their limits: bc7/effort.hpp's Errors.
struct Parts {
    Lanes color;
    Lanes alpha;
    Lanes worst;
};

// The first three channels are colour, the fourth is alpha.
template <int Channels>
PARADIZE_INLINE void parts_of(const ChannelErrors<Channels> &left, Parts &parts) {
    parts.color = left.square[0] + left.square[1] + left.square[2];
    parts.worst = larger(larger(left.worst[0], left.worst[1]), left.worst[2]);
    if constexpr (Channels == 4) {
        parts.alpha = left.square[3];
    } else {
        parts.alpha = Lanes{};
    }
}

PARADIZE_INLINE IntLanes inside(const Parts &parts, const Parts &limit) {
    return (parts.color <= limit.color) & (parts.alpha <= limit.alpha) & (parts.worst <= limit.worst);
}

struct Best {
    float alpha_weight; // how much an error of alpha counts beside one of a colour's channel
    Lanes error;
    Parts left;
    Parts limit;
    IntLanes mode;
    IntLanes partition;
    IntLanes rotation;
    IntLanes selector;
    Lanes code[3][2][4];
    Lanes index[texels];
    Lanes second[texels];
};

PARADIZE_INLINE void clear(Best &best, float alpha_weight) {
    best.alpha_weight = alpha_weight;
    best.error = all(1e30F);
    best.left.color = best.left.alpha = best.left.worst = Lanes{};
    best.mode = best.partition = best.rotation = best.selector = IntLanes{};
    for (int t = 0; t < texels; ++t) {
        best.index[t] = best.second[t] = Lanes{};
    }
    for (auto &subset : best.code) {
        for (auto &end : subset) {
            for (Lanes &code : end) {
                code = Lanes{};
            }
        }
    }
}

// Takes what was found where it is better, and says where that was.
template <int Channels, int Subsets>
PARADIZE_INLINE IntLanes offer(const BlockFit<Channels, Subsets> &found, const Lanes &error,
                               const Parts &parts, int mode, const IntLanes &partition,
                               const IntLanes &rotation, int selector, Best &best) {
    const IntLanes better = (error < best.error) & inside(parts, best.limit);
    if (!any(better)) {
        return better;
    }
    best.error = better ? error : best.error;
    best.left.color = better ? parts.color : best.left.color;
    best.left.alpha = better ? parts.alpha : best.left.alpha;
    best.left.worst = better ? parts.worst : best.left.worst;
    best.mode = better ? IntLanes{} + mode : best.mode;
    best.partition = better ? partition : best.partition;
    best.rotation = better ? rotation : best.rotation;
    best.selector = better ? IntLanes{} + selector : best.selector;
    for (int s = 0; s < Subsets; ++s) {
        for (int c = 0; c < Channels; ++c) {
            best.code[s][0][c] = better ? found.code[s].a[c] : best.code[s][0][c];
            best.code[s][1][c] = better ? found.code[s].b[c] : best.code[s][1][c];
        }
    }
    for (int t = 0; t < texels; ++t) {
        best.index[t] = better ? found.index[t] : best.index[t];
    }
    return better;
}

// Fits all channels together and takes what was found where it is better.
template <typename S>
PARADIZE_INLINE void try_joint(const Lanes (*const *values)[texels], const Members<S::Subsets> &members,
                               const Sums<S::Channels> *sums, Endpoints<S::Channels> *ends, int mode,
                               const IntLanes &partition, int passes, Best &best) {
    Lanes weights[4] = {all(1.0F), all(1.0F), all(1.0F), all(best.alpha_weight)};
    BlockFit<S::Channels, S::Subsets> found;
    const auto allowed = [&](const ChannelErrors<S::Channels> &left) {
        Parts parts;
        parts_of(left, parts);
        return inside(parts, best.limit);
    };
    fit<S>(values, S::Channels == 4 ? weights : nullptr, members, sums, ends, passes, allowed, found);
    Parts parts;
    parts_of(found.left, parts);
    offer(found, found.error, parts, mode, partition, IntLanes{}, 0, best);
}

// Mode 6: one subset, sixteen places. Opaque blocks have all low bits set, so that alpha is 255.
template <int Channels>
static void try_mode6(const Block &block, const Products<Channels> &products, int passes, Best &best) {
    using S = Shape<Channels, 8, Channels == 3 ? Low::ones : Low::own, 15, 1>;
    const Lanes(*values[Channels])[texels];
    for (int c = 0; c < Channels; ++c) {
        values[c] = &block.v[c];
    }
    Endpoints<Channels> ends[1];
    const Members<1> members{};
    first_ends<Channels>(values, nullptr, products.total, ends[0]);
    try_joint<S>(values, members, &products.total, ends, 6, IntLanes{}, passes, best);
    // The box's diagonal is seldom better, but then by much of what little there is.
    for (int c = 0; c < Channels; ++c) {
        ends[0].a[c] = ends[0].b[c] = block.v[c][0];
        for (int t = 1; t < texels; ++t) {
            ends[0].a[c] = smaller(ends[0].a[c], block.v[c][t]);
            ends[0].b[c] = larger(ends[0].b[c], block.v[c][t]);
        }
    }
    try_joint<S>(values, members, &products.total, ends, 6, IntLanes{}, passes - 1, best);
    if constexpr (Channels == 3) {
        for (auto &end : best.code[0]) {
            end[3] = all(255.0F);
        }
    }
}

// A mode of two or three subsets, in the partition that each block wants.
template <typename S>
static void try_partition(const Block &block, const Products<S::Channels> &products, int mode,
                          const IntLanes &partition, int passes, Best &best) {
    constexpr int C = S::Channels;
    const Lanes(*values[C])[texels];
    for (int c = 0; c < C; ++c) {
        values[c] = &block.v[c];
    }
    IntLanes bits{};
    for (int lane = 0; lane < lanes; ++lane) {
        const auto at = static_cast<std::size_t>(partition[lane]);
        bits[lane] = static_cast<std::int32_t>(S::Subsets == 2 ? two_subsets[at] : three_subsets[at]);
    }
    Members<S::Subsets> members;
    Sums<C> sums[S::Subsets];
    for (int s = 1; s < S::Subsets; ++s) {
        clear(sums[s]);
        for (int t = 0; t < texels; ++t) {
            const int at = S::Subsets == 2 ? t : 2 * t + s - 1;
            const IntLanes one = IntLanes{} + static_cast<std::int32_t>(1U << at);
            members.of[s - 1][t] = (bits & one) != 0;
            add_member(block, products, t, members.of[s - 1][t], sums[s]);
        }
    }
    subtract(products.total, sums[1], sums[0]);
    IntLanes mine[texels];
    for (int t = 0; t < texels; ++t) {
        mine[t] = ~members.of[0][t];
    }
    if constexpr (S::Subsets == 3) {
        subtract(sums[0], sums[2], sums[0]);
        for (int t = 0; t < texels; ++t) {
            mine[t] &= ~members.of[1][t];
        }
    }
    Endpoints<C> ends[S::Subsets];
    first_ends<C>(values, mine, sums[0], ends[0]);
    for (int s = 1; s < S::Subsets; ++s) {
        first_ends<C>(values, members.of[s - 1], sums[s], ends[s]);
    }
    try_joint<S>(values, members, sums, ends, mode, partition, passes, best);
}

// Parts of a block are judged together, when both are found.
constexpr auto any_left = [](const auto &) { return IntLanes{} == 0; };

// The last channel by itself, as modes 4 and 5 have it.
template <int Bits, int Steps>
PARADIZE_INLINE void fit_alone(const Block &block, int passes, BlockFit<1, 1> &found) {
    const Lanes(*const values[1])[texels] = {&block.v[3]};
    Sums<1> sums;
    clear(sums);
    sums.count = all(static_cast<float>(texels));
    Endpoints<1> ends[1] = {{{block.v[3][0]}, {block.v[3][0]}}};
    for (int t = 0; t < texels; ++t) {
        sums.value[0] += block.v[3][t];
        ends[0].a[0] = smaller(ends[0].a[0], block.v[3][t]);
        ends[0].b[0] = larger(ends[0].b[0], block.v[3][t]);
    }
    fit<Shape<1, Bits, Low::none, Steps, 1>>(values, nullptr, Members<1>{}, &sums, ends, passes, any_left,
                                             found);
}

template <int Bits, int Steps>
PARADIZE_INLINE void fit_colors(const Lanes (*const *values)[texels], const Lanes *weight,
                                const Sums<3> &sums, Endpoints<3> ends, int passes, BlockFit<3, 1> &found) {
    fit<Shape<3, Bits, Low::none, Steps, 1>>(values, weight, Members<1>{}, &sums, &ends, passes, any_left,
                                             found);
}

PARADIZE_INLINE void offer_apart(const BlockFit<3, 1> &colors, const BlockFit<1, 1> &alone, int mode,
                                 const IntLanes &rotation, int selector, Best &best) {
    const IntLanes plain = rotation == 0;
    Parts parts;
    parts.color = plain ? Lanes{} : alone.left.square[0];
    parts.alpha = plain ? alone.left.square[0] : Lanes{};
    parts.worst = plain ? Lanes{} : alone.left.worst[0];
    for (int c = 0; c < 3; ++c) {
        const IntLanes moved = rotation == c + 1;
        parts.color += moved ? Lanes{} : colors.left.square[c];
        parts.alpha += moved ? colors.left.square[c] : Lanes{};
        parts.worst = larger(parts.worst, moved ? Lanes{} : colors.left.worst[c]);
    }
    const Lanes error = parts.color + parts.alpha * best.alpha_weight;
    const IntLanes better = offer(colors, error, parts, mode, IntLanes{}, rotation, selector, best);
    best.code[0][0][3] = better ? alone.code[0].a[0] : best.code[0][0][3];
    best.code[0][1][3] = better ? alone.code[0].b[0] : best.code[0][1][3];
    for (int t = 0; t < texels; ++t) {
        best.second[t] = better ? alone.index[t] : best.second[t];
    }
}

// Alpha changes places with the channel `rotation - 1`; 0: none does.
PARADIZE_INLINE void rotate(const Block &block, const IntLanes &rotation, Block &out) {
    for (int t = 0; t < texels; ++t) {
        out.v[3][t] = block.v[3][t];
        for (int c = 0; c < 3; ++c) {
            const IntLanes moved = rotation == c + 1;
            out.v[c][t] = moved ? block.v[3][t] : block.v[c][t];
            out.v[3][t] = moved ? block.v[c][t] : out.v[3][t];
        }
    }
}

// Modes 4 and 5: three channels on a line, the fourth alone.
static void try_apart(const Block &plain, const IntLanes &rotation, int passes, Best &best) {
    Block block;
    rotate(plain, rotation, block);
    const Lanes(*const values[3])[texels] = {&block.v[0], &block.v[1], &block.v[2]};
    Products<3> products;
    make_products(block, products);
    const Sums<3> &sums = products.total;
    Endpoints<3> ends;
    first_ends<3>(values, nullptr, sums, ends);
    Lanes weight[3]; // alpha stands where the channel stood that it changed places with
    for (int c = 0; c < 3; ++c) {
        weight[c] = rotation == c + 1 ? all(best.alpha_weight) : all(1.0F);
    }
    BlockFit<3, 1> colors;
    BlockFit<1, 1> single;
    fit_colors<7, 3>(values, weight, sums, ends, passes, colors);
    fit_alone<8, 3>(block, passes, single);
    offer_apart(colors, single, 5, rotation, 0, best);
    fit_colors<5, 3>(values, weight, sums, ends, passes, colors);
    fit_alone<6, 7>(block, passes, single);
    offer_apart(colors, single, 4, rotation, 0, best);
    fit_colors<5, 7>(values, weight, sums, ends, passes, colors);
    fit_alone<6, 3>(block, passes, single);
    offer_apart(colors, single, 4, rotation, 1, best);
}

} // namespace paradize::bc7::PARADIZE_WIDTH
