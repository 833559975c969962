#include "normals/islands.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "simd/cpu.hpp"

namespace paradize::normals {
namespace {

constexpr std::int32_t nowhere = std::numeric_limits<std::int32_t>::min(); // no texel's id that is looked at

// Whether an id within `within` texels on either side differs.
PARADIZE_CLONES void breaks(const std::int32_t *__restrict ids, std::size_t columns, int within,
                            std::uint8_t *__restrict to) {
    std::fill(to, to + columns, std::uint8_t{0});
    for (std::ptrdiff_t k = 1; k <= within; ++k) {
        const std::int32_t *before = ids - k;
        const std::int32_t *after = ids + k;
        for (std::size_t x = 0; x < columns; ++x) {
            to[x] |= static_cast<std::uint8_t>((before[x] != ids[x]) | (after[x] != ids[x]));
        }
    }
}

// Adds the texels whose id differs, and those that one of the two arrays holds.
PARADIZE_CLONES void mark_row(const std::int32_t *__restrict ids, const std::int32_t *__restrict own,
                              const std::uint8_t *__restrict first, std::uint8_t first_counts,
                              const std::uint8_t *__restrict second, std::uint8_t second_counts,
                              std::size_t columns, std::uint8_t *__restrict to) {
    for (std::size_t x = 0; x < columns; ++x) {
        to[x] |= static_cast<std::uint8_t>((ids[x] != own[x]) | (first[x] & first_counts) |
                                           (second[x] & second_counts));
    }
}

constexpr std::size_t lanes = IslandRows::run;
typedef double Reals __attribute__((vector_size(lanes * sizeof(double))));
typedef float Floats __attribute__((vector_size(lanes * sizeof(float))));
typedef std::int32_t Ids __attribute__((vector_size(lanes * sizeof(std::int32_t))));
typedef std::int64_t Masks __attribute__((vector_size(lanes * sizeof(std::int64_t))));

// The slopes of `lanes` texels from x on, in units of height per texel: the sum of all pairs; where a pair is
// lost, neither of its taps being on the island, half of the one at `middle` instead. `own` and `heights` are
// those of the row's first texel.
PARADIZE_CLONES void add_pairs(const IslandRows::Pair *pairs, std::size_t count, std::size_t middle,
                               std::size_t x, const std::int32_t *own, const float *heights, double *to) {
    Ids id;
    Floats flat;
    std::memcpy(&id, own + x, sizeof id);
    std::memcpy(&flat, heights + x, sizeof flat);
    const Reals here = __builtin_convertvector(flat, Reals);
    Reals sum = {};
    Reals nearest = {};
    Masks kept = ~Masks{};
    for (std::size_t i = 0; i < count; ++i) {
        const IslandRows::Pair &pair = pairs[i];
        Ids ids;
        std::memcpy(&ids, pair.after_ids + x, sizeof ids);
        const Masks after = __builtin_convertvector(ids == id, Masks);
        std::memcpy(&ids, pair.before_ids + x, sizeof ids);
        const Masks before = __builtin_convertvector(ids == id, Masks);
        std::memcpy(&flat, pair.after_heights + x, sizeof flat);
        const Reals above = __builtin_convertvector(flat, Reals);
        std::memcpy(&flat, pair.before_heights + x, sizeof flat);
        const Reals below = __builtin_convertvector(flat, Reals);
        const Reals once = (after ? above : here) - (before ? below : here);
        const Reals difference = (after & before) ? once : once + once;
        kept &= after | before;
        if (i > middle && i % 8 == 0) { // often all of them lose a pair early
            std::int64_t any = 0;
            for (std::size_t lane = 0; lane < lanes; ++lane) {
                any |= kept[lane];
            }
            if (any == 0) {
                break;
            }
        }
        sum += pair.weight * difference;
        if (i == middle) {
            nearest = 0.5 * difference;
        }
    }
    const Reals slopes = kept ? sum : nearest;
    std::memcpy(to, &slopes, sizeof slopes);
}

} // namespace

IslandRows::IslandRows(std::span<const float> heights, std::span<const std::int32_t> islands,
                       std::size_t rows, std::size_t columns, const Settings &settings)
    : heights_(heights), islands_(islands), rows_(rows), columns_(columns), settings_(settings),
      depth_(static_cast<std::size_t>(std::max(settings.reach, settings.across))), lines_(2 * depth_ + 1),
      marked_(columns), around_(2 * depth_ + 1) {
    for (IdLine &line : lines_) {
        line.ids.resize(columns + 2 * depth_);
        line.on_map.resize(columns + 2 * depth_ + run, nowhere); // a run may end beyond the row
        line.heights.resize(columns + 2 * depth_ + run);
        line.along_breaks.resize(columns);
        line.cross_breaks.resize(columns);
        line.held = std::numeric_limits<std::ptrdiff_t>::min();
    }
}

// The row y, repeated beyond the edges where the map repeats.
const IslandRows::IdLine &IslandRows::line(std::ptrdiff_t y) {
    const auto count = static_cast<std::ptrdiff_t>(lines_.size());
    IdLine &line = lines_[static_cast<std::size_t>(((y % count) + count) % count)];
    if (line.held == y) {
        return line;
    }
    const Tap row = tap(y, rows_, settings_.wrap_y);
    const std::int32_t *from = &islands_[row.at * columns_];
    const float *heights = &heights_[row.at * columns_];
    const auto extend = [&](std::size_t i) {
        const auto x = static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(depth_);
        const Tap column = tap(x, columns_, settings_.wrap_x);
        const bool beyond = row.reflected || column.reflected;
        line.ids[i] = from[column.at];
        line.on_map[i] = beyond ? nowhere : from[column.at];
        line.heights[i] = beyond ? 0.0F : heights[column.at];
    };
    for (std::size_t i = 0; i < depth_; ++i) {
        extend(i);
        extend(depth_ + columns_ + i);
    }
    const auto middle = static_cast<std::ptrdiff_t>(depth_);
    std::copy(from, from + columns_, line.ids.begin() + middle);
    if (row.reflected) {
        std::fill_n(line.on_map.begin() + middle, columns_, nowhere);
        std::fill_n(line.heights.begin() + middle, columns_, 0.0F);
    } else {
        std::copy(from, from + columns_, line.on_map.begin() + middle);
        std::copy(heights, heights + columns_, line.heights.begin() + middle);
    }
    breaks(line.ids.data() + depth_, columns_, settings_.reach, line.along_breaks.data());
    breaks(line.ids.data() + depth_, columns_, settings_.across, line.cross_breaks.data());
    line.held = y;
    return line;
}

// The texels of row y with a tap on another island: those of the slope along x stand up to `reach` columns
// and `across` rows away, those of the slope down the other way round.
void IslandRows::mark(std::size_t y) {
    const auto here = static_cast<std::ptrdiff_t>(y);
    std::fill(marked_.begin(), marked_.end(), std::uint8_t{0});
    const std::int32_t *own = line(here).ids.data() + depth_;
    const auto depth = static_cast<std::ptrdiff_t>(depth_);
    for (std::ptrdiff_t j = -depth; j <= depth; ++j) {
        const IdLine &other = line(here + j);
        const std::int32_t *ids = other.ids.data() + depth_;
        const std::uint8_t along = j >= -settings_.across && j <= settings_.across ? 1 : 0;
        const std::uint8_t cross = j >= -settings_.reach && j <= settings_.reach ? 1 : 0;
        mark_row(ids, own, other.along_breaks.data(), along, other.cross_breaks.data(), cross, columns_,
                 marked_.data());
    }
}

// Of the row in the middle of around_, the nearest first.
template <bool down>
void IslandRows::pair_up(std::vector<Pair> &pairs) const {
    pairs.clear();
    const auto depth = static_cast<std::ptrdiff_t>(depth_);
    for (std::ptrdiff_t k = 1; k <= settings_.reach; ++k) {
        for (std::ptrdiff_t j = -settings_.across; j <= settings_.across; ++j) {
            const std::ptrdiff_t rows = down ? k : j;
            const std::ptrdiff_t columns = down ? j : k;
            const IdLine &after = *around_[static_cast<std::size_t>(depth + rows)];
            const IdLine &before = *around_[static_cast<std::size_t>(depth - rows)];
            pairs.push_back({after.on_map.data() + depth + columns, after.heights.data() + depth + columns,
                             before.on_map.data() + depth - columns, before.heights.data() + depth - columns,
                             settings_.derivative[k - 1] * settings_.smooth[j < 0 ? -j : j]});
        }
    }
}

void IslandRows::patch(std::size_t y, float *xyz) {
    mark(y);
    for (std::size_t i = 0; i < around_.size(); ++i) {
        around_[i] = &line(static_cast<std::ptrdiff_t>(y + i) - static_cast<std::ptrdiff_t>(depth_));
    }
    const double sy = settings_.green_down ? -settings_.scale_y : settings_.scale_y;
    pair_up<false>(along_);
    pair_up<true>(down_);
    const std::int32_t *own = around_[depth_]->on_map.data() + depth_;
    const float *heights = around_[depth_]->heights.data() + depth_;
    const auto nearest = static_cast<std::size_t>(settings_.across); // of the pairs: k 1, j 0
    std::array<double, run> along;
    std::array<double, run> down;
    const auto wanted = [&](std::size_t x) { return marked_[x] != 0 && islands_[y * columns_ + x] >= 0; };
    for (std::size_t x = 0; x < columns_;) {
        if (!wanted(x)) {
            ++x;
            continue;
        }
        add_pairs(along_.data(), along_.size(), nearest, x, own, heights, along.data());
        add_pairs(down_.data(), down_.size(), nearest, x, own, heights, down.data());
        const std::size_t end = std::min(run, columns_ - x);
        for (std::size_t i = 0; i < end; ++i) {
            if (!wanted(x + i)) {
                continue;
            }
            const double nx = -settings_.scale_x * along[i];
            const double ny = sy * down[i];
            steep_normals(&nx, &ny, 1, xyz + 3 * (x + i));
        }
        x += end;
    }
}

} // namespace paradize::normals
