// The search of a row's blocks: trials are gathered into vectors from whichever blocks want them, so that
// easy blocks cost little. What a block gets depends on nothing but its own texels.
#pragma once

#include "bc7/modes.hpp"
#include "bc7/pack.hpp"
#include "bc7/picture.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// A row's part: its blocks of one kind, opaque or not.
struct Search {
    const Picture &picture;
    std::size_t row;
    const Effort &effort;
    float alpha_weight;
    Scratch &scratch;
    std::size_t count;
    std::uint8_t *out; // of the row
};

// The texels of up to `lanes` tasks; the last stands in for those that are missing.
PARADIZE_CALLED void load(const Search &search, const std::uint16_t *jobs, std::size_t count, Block &block) {
    alignas(64) std::uint32_t packed[texels][lanes];
    for (std::size_t lane = 0; lane < lanes; ++lane) {
        const Task &task = search.scratch.tasks[jobs[lane < count ? lane : count - 1]];
        std::uint32_t block_texels[texels];
        search.picture.block(search.row, task.column, block_texels);
        for (int t = 0; t < texels; ++t) {
            packed[t][lane] = block_texels[t];
        }
    }
    for (int t = 0; t < texels; ++t) {
        IntLanes bits;
        __builtin_memcpy(&bits, packed[t], sizeof bits);
        for (int c = 0; c < 4; ++c) {
            block.v[c][t] = __builtin_convertvector((bits >> (8 * c)) & 255, Lanes);
        }
    }
}

// The results of the tier below for up to `lanes` tasks.
PARADIZE_CALLED void load_limits(const Search &search, const std::uint16_t *jobs, std::size_t count,
                                 Parts &limit) {
    for (std::size_t lane = 0; lane < lanes; ++lane) {
        const Errors &errors = search.scratch.tasks[jobs[lane < count ? lane : count - 1]].limit;
        limit.color[lane] = errors.color;
        limit.alpha[lane] = errors.alpha;
        limit.worst[lane] = errors.worst;
    }
}

// Sixteen indices as four bits each: of the first eight texels and of the others.
PARADIZE_INLINE void join(const Lanes *index, IntLanes &low, IntLanes &high) {
    low = high = IntLanes{};
    for (int t = 0; t < 8; ++t) {
        low |= __builtin_convertvector(index[t], IntLanes) << (4 * t);
        high |= __builtin_convertvector(index[t + 8], IntLanes) << (4 * t);
    }
}

PARADIZE_INLINE std::uint64_t joined(const IntLanes &low, const IntLanes &high, int lane) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(high[lane])) << 32 |
           static_cast<std::uint32_t>(low[lane]);
}

// Writes the bytes of the blocks that became better.
PARADIZE_CALLED void settle(const Search &search, const std::uint16_t *jobs, std::size_t count,
                            const Best &best) {
    IntLanes low;
    IntLanes high;
    IntLanes second_low;
    IntLanes second_high;
    join(best.index, low, high);
    join(best.second, second_low, second_high);
    for (int lane = 0; lane < static_cast<int>(count); ++lane) {
        Task &task = search.scratch.tasks[jobs[lane]];
        if (!(best.error[lane] < task.error)) {
            continue;
        }
        task.error = best.error[lane];
        task.left = {best.left.color[lane], best.left.alpha[lane], best.left.worst[lane]};
        Choice choice;
        choice.mode = best.mode[lane];
        choice.partition = best.partition[lane];
        choice.rotation = best.rotation[lane];
        choice.selector = best.selector[lane];
        const Mode &mode = modes[static_cast<std::size_t>(choice.mode)];
        for (int s = 0; s < mode.subsets; ++s) {
            for (int end = 0; end < 2; ++end) {
                for (int c = 0; c < 4; ++c) {
                    choice.code[s][end][c] = static_cast<int>(best.code[s][end][c][lane]);
                }
            }
        }
        choice.index = joined(low, high, lane);
        choice.second = joined(second_low, second_high, lane);
        pack(choice, search.out + 16 * std::size_t{task.column});
    }
}

// Collects the tasks that `wanted` names and hands them to `work`, a vector's full at a time.
template <typename Wanted, typename Work>
PARADIZE_INLINE void gather(const Search &search, Wanted &&wanted, Work &&work) {
    std::uint16_t *jobs = search.scratch.jobs;
    std::size_t found = 0;
    for (std::size_t i = 0; i < search.count; ++i) {
        jobs[found] = static_cast<std::uint16_t>(i);
        found += wanted(search.scratch.tasks[i]) ? 1 : 0;
    }
    for (std::size_t first = 0; first < found; first += lanes) {
        const std::size_t some = found - first < lanes ? found - first : lanes;
        Block block;
        load(search, jobs + first, some, block);
        work(block, jobs + first, some);
    }
}

PARADIZE_INLINE void store(const Search &search, const std::uint16_t *jobs, std::size_t some, int family,
                           const BestPartitions &kept, int count) {
    for (std::size_t lane = 0; lane < some; ++lane) {
        Ranked &ranked = search.scratch.tasks[jobs[lane]].ranked[family];
        for (int i = 0; i < count; ++i) {
            ranked.estimate[i] = kept.error[i][lane];
            ranked.number[i] = static_cast<std::uint8_t>(kept.partition[i][lane]);
        }
    }
}

// Tries the candidates of a family one after another, each where its estimate still promises something.
template <typename Try>
PARADIZE_INLINE void try_family(const Search &search, int family, int count, float enough, Try &&attempt) {
    for (int i = 0; i < count; ++i) {
        gather(
            search,
            [&](const Task &task) {
                return task.error > enough &&
                       task.ranked[family].estimate[i] * search.effort.doubt < task.error;
            },
            [&](const Block &block, const std::uint16_t *jobs, std::size_t some) {
                IntLanes number{};
                for (std::size_t lane = 0; lane < lanes; ++lane) {
                    const Task &task = search.scratch.tasks[jobs[lane < some ? lane : some - 1]];
                    number[lane] = task.ranked[family].number[i];
                }
                Best best;
                clear(best, search.alpha_weight);
                load_limits(search, jobs, some, best.limit);
                attempt(block, number, best);
                settle(search, jobs, some, best);
            });
    }
}

template <typename S>
static void try_partitions(const Search &search, int family, int mode, int count, float enough) {
    try_family(search, family, count, enough, [&](const Block &block, const IntLanes &number, Best &best) {
        Products<S::Channels> products;
        make_products(block, products);
        try_partition<S>(block, products, mode, number, search.effort.passes, best);
    });
}

template <int Channels>
static void start(const Search &search) {
    gather(
        search, [](const Task &) { return true; },
        [&](const Block &block, const std::uint16_t *jobs, std::size_t some) {
            Products<Channels> products;
            make_products(block, products);
            Best best;
            clear(best, search.alpha_weight);
            load_limits(search, jobs, some, best.limit);
            try_mode6(block, products, search.effort.passes6, best);
            settle(search, jobs, some, best);
        });
}

template <int Subsets, int Channels>
static void rank_partitions(const Search &search, int family, int fine_count, int coarse_count,
                            float enough) {
    if (fine_count + coarse_count == 0) {
        return;
    }
    constexpr int fine_among = Subsets == 3 ? partitions_of_mode0 : partitions;
    gather(
        search, [&](const Task &task) { return task.error > enough; },
        [&](const Block &block, const std::uint16_t *jobs, std::size_t some) {
            Products<Channels> products;
            make_products(block, products);
            BestPartitions fine;
            BestPartitions coarse;
            rank<Subsets>(block, products, coarse_count > 0 ? partitions : fine_among, fine, fine_count,
                          fine_among, coarse, coarse_count);
            store(search, jobs, some, family, fine, fine_count);
            store(search, jobs, some, family + 1, coarse, coarse_count);
        });
}

static void search_apart(const Search &search, int rotations) {
    constexpr int family = 4;
    if (rotations == 0) {
        return;
    }
    gather(
        search, [&](const Task &task) { return task.error > search.effort.enough; },
        [&](const Block &block, const std::uint16_t *jobs, std::size_t some) {
            Products<4> products;
            make_products(block, products);
            BestPartitions kept;
            rank_alone(products, kept, rotations);
            store(search, jobs, some, family, kept, rotations);
        });
    try_family(search, family, rotations, search.effort.enough,
               [&](const Block &block, const IntLanes &number, Best &best) {
                   try_apart(block, number, search.effort.passes, best);
               });
}

static void search_opaque(const Search &search) {
    const Effort &effort = search.effort;
    start<3>(search);
    rank_partitions<2, 3>(search, 0, effort.mode1, effort.mode3, effort.enough);
    try_partitions<Shape<3, 7, Low::shared, 7, 2>>(search, 0, 1, effort.mode1, effort.enough);
    try_partitions<Shape<3, 8, Low::own, 3, 2>>(search, 1, 3, effort.mode3, effort.enough);
    search_apart(search, effort.opaque_rotations);
    rank_partitions<3, 3>(search, 2, effort.mode0, effort.mode2, effort.enough_for_three);
    try_partitions<Shape<3, 5, Low::own, 7, 3>>(search, 2, 0, effort.mode0, effort.enough_for_three);
    try_partitions<Shape<3, 5, Low::none, 3, 3>>(search, 3, 2, effort.mode2, effort.enough_for_three);
}

static void search_alpha(const Search &search) {
    const Effort &effort = search.effort;
    start<4>(search);
    search_apart(search, effort.rotations);
    rank_partitions<2, 4>(search, 0, 0, effort.mode7, effort.enough);
    try_partitions<Shape<4, 6, Low::own, 3, 2>>(search, 1, 7, effort.mode7, effort.enough);
}

} // namespace paradize::bc7::PARADIZE_WIDTH
