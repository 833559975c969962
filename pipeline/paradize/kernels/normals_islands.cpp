#include "normals_islands.hpp"

#include <algorithm>
#include <array>

#include "maps_parallel.hpp"

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

// The taps on one side, for consecutive texels.
struct Side {
    const std::int32_t *ids;
    const float *heights;
};

// Adds a pair of taps to the slopes of a run of texels; lost: those of which neither tap is on the island.
PARADIZE_CLONES void add_pairs(const std::int32_t *__restrict own, const double *__restrict here,
                               const Side &after, const Side &before, double weight, double *__restrict sums,
                               std::int32_t *__restrict lost) {
    const std::int32_t *after_ids = after.ids;
    const std::int32_t *before_ids = before.ids;
    const float *after_heights = after.heights;
    const float *before_heights = before.heights;
    for (std::size_t i = 0; i < IslandRows::run; ++i) {
        const bool has_after = after_ids[i] == own[i];
        const bool has_before = before_ids[i] == own[i];
        const double above = after_heights[i];
        const double below = before_heights[i];
        const double difference = (has_after ? above : here[i]) - (has_before ? below : here[i]);
        const double factor = has_after && has_before ? 1.0 : 2.0;
        sums[i] += weight * (factor * difference);
        lost[i] |= static_cast<std::int32_t>(!has_after) & static_cast<std::int32_t>(!has_before);
    }
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

// Of a run of texels from column x on, of the row in the middle of around_, in units of height per texel,
// with the taps that stay on the island.
template <bool down>
void IslandRows::slopes(std::size_t x, double *to) const {
    const std::size_t middle = x + depth_;
    const std::int32_t *own = around_[depth_]->on_map.data() + middle;
    std::array<double, run> here;
    std::copy_n(around_[depth_]->heights.data() + middle, run, here.begin());
    const auto add = [&](std::ptrdiff_t k, std::ptrdiff_t j, double weight, double *sums,
                         std::int32_t *lost) {
        const auto row = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(depth_) + (down ? k : j));
        const auto column = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(middle) + (down ? j : k));
        const IdLine &after = *around_[row];
        const IdLine &before = *around_[2 * depth_ - row];
        const std::size_t opposite = 2 * middle - column;
        add_pairs(own, here.data(), {after.on_map.data() + column, after.heights.data() + column},
                  {before.on_map.data() + opposite, before.heights.data() + opposite}, weight, sums, lost);
    };
    std::array<std::int32_t, run> lost{};
    std::fill_n(to, run, 0.0);
    for (std::ptrdiff_t k = 1; k <= settings_.reach; ++k) {
        for (std::ptrdiff_t j = -settings_.across; j <= settings_.across; ++j) {
            add(k, j, settings_.derivative[k - 1] * settings_.smooth[j < 0 ? -j : j], to, lost.data());
        }
    }
    std::array<double, run> nearest{};
    std::array<std::int32_t, run> unused{};
    add(1, 0, 0.5, nearest.data(), unused.data());
    for (std::size_t i = 0; i < run; ++i) {
        to[i] = lost[i] != 0 ? nearest[i] : to[i]; // where too little of the filter is left
    }
}

void IslandRows::patch(std::size_t y, Encoding encoding, std::uint8_t *codes) {
    mark(y);
    for (std::size_t i = 0; i < around_.size(); ++i) {
        around_[i] = &line(static_cast<std::ptrdiff_t>(y + i) - static_cast<std::ptrdiff_t>(depth_));
    }
    const double sy = settings_.green_down ? -settings_.scale_y : settings_.scale_y;
    std::array<double, run> along;
    std::array<double, run> across;
    const auto wanted = [&](std::size_t x) { return marked_[x] != 0 && islands_[y * columns_ + x] >= 0; };
    for (std::size_t x = 0; x < columns_;) {
        if (!wanted(x)) {
            ++x;
            continue;
        }
        slopes<false>(x, along.data());
        slopes<true>(x, across.data());
        const std::size_t end = std::min(run, columns_ - x);
        for (std::size_t i = 0; i < end; ++i) {
            if (!wanted(x + i)) {
                continue;
            }
            const double nx = -settings_.scale_x * along[i];
            const double ny = sy * across[i];
            float xyz[3];
            steep_normals(&nx, &ny, 1, xyz);
            encode_row(xyz, 1, encoding, {codes + (x + i) * texel_bytes(encoding), nullptr, nullptr});
        }
        x += end;
    }
}

} // namespace paradize::normals
