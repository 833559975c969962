#include "normals_islands.hpp"

#include <algorithm>

namespace paradize::normals {
namespace {

constexpr std::int32_t nowhere = std::numeric_limits<std::int32_t>::min(); // no texel's id that is looked at

} // namespace

IslandRows::IslandRows(std::span<const float> heights, std::span<const std::int32_t> islands,
                       std::size_t rows, std::size_t columns, const Settings &settings)
    : heights_(heights), islands_(islands), rows_(rows), columns_(columns), settings_(settings),
      depth_(static_cast<std::size_t>(std::max(settings.reach, settings.across))), lines_(2 * depth_ + 1),
      marked_(columns), around_(2 * depth_ + 1) {
    for (IdLine &line : lines_) {
        line.ids.resize(columns + 2 * depth_);
        line.on_map.resize(columns + 2 * depth_);
        line.heights.resize(columns + 2 * depth_);
        line.along_breaks.resize(columns);
        line.cross_breaks.resize(columns);
        line.held = std::numeric_limits<std::ptrdiff_t>::min();
    }
}

void IslandRows::breaks(const IdLine &line, int within, std::vector<std::uint8_t> &to) const {
    std::fill(to.begin(), to.end(), std::uint8_t{0});
    const std::int32_t *ids = line.ids.data() + depth_;
    for (std::ptrdiff_t k = 1; k <= within; ++k) {
        for (std::size_t x = 0; x < columns_; ++x) {
            const auto at = static_cast<std::ptrdiff_t>(x);
            to[x] |= static_cast<std::uint8_t>((ids[at - k] != ids[at]) | (ids[at + k] != ids[at]));
        }
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
    for (std::size_t i = 0; i < line.ids.size(); ++i) {
        const auto x = static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(depth_);
        const Tap column = tap(x, columns_, settings_.wrap_x);
        const bool beyond = row.reflected || column.reflected;
        line.ids[i] = from[column.at];
        line.on_map[i] = beyond ? nowhere : from[column.at];
        line.heights[i] = beyond ? 0.0F : heights[column.at];
    }
    breaks(line, settings_.reach, line.along_breaks);
    breaks(line, settings_.across, line.cross_breaks);
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
        for (std::size_t x = 0; x < columns_; ++x) {
            marked_[x] |= static_cast<std::uint8_t>((ids[x] != own[x]) | (other.along_breaks[x] & along) |
                                                    (other.cross_breaks[x] & cross));
        }
    }
}

// Of column x of the row in the middle of around_, in units of height per texel, with the taps that stay on
// the island.
template <bool down>
double IslandRows::slope(std::size_t x) const {
    const std::size_t middle = x + depth_;
    const std::int32_t id = around_[depth_]->on_map[middle];
    const double here = around_[depth_]->heights[middle];
    const auto pair = [&](std::ptrdiff_t k, std::ptrdiff_t j, bool &lost) {
        const auto row = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(depth_) + (down ? k : j));
        const auto column = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(middle) + (down ? j : k));
        const IdLine &line_after = *around_[row];
        const IdLine &line_before = *around_[2 * depth_ - row];
        const bool after = line_after.on_map[column] == id;
        const bool before = line_before.on_map[2 * middle - column] == id;
        lost = !after && !before;
        const double high = after ? line_after.heights[column] : here;
        const double low = before ? line_before.heights[2 * middle - column] : here;
        return after && before ? high - low : 2.0 * (high - low);
    };
    double sum = 0.0;
    for (std::ptrdiff_t k = 1; k <= settings_.reach; ++k) {
        for (std::ptrdiff_t j = -settings_.across; j <= settings_.across; ++j) {
            bool lost = false;
            const double difference = pair(k, j, lost);
            if (lost) { // too little of the filter is left
                return 0.5 * pair(1, 0, lost);
            }
            sum += settings_.derivative[k - 1] * settings_.smooth[j < 0 ? -j : j] * difference;
        }
    }
    return sum;
}

void IslandRows::patch(std::size_t y, Encoding encoding, std::uint8_t *codes) {
    mark(y);
    for (std::size_t i = 0; i < around_.size(); ++i) {
        around_[i] = &line(static_cast<std::ptrdiff_t>(y + i) - static_cast<std::ptrdiff_t>(depth_));
    }
    const double sy = settings_.green_down ? -settings_.scale_y : settings_.scale_y;
    for (std::size_t x = 0; x < columns_; ++x) {
        if (marked_[x] == 0 || islands_[y * columns_ + x] < 0) {
            continue;
        }
        const double nx = -settings_.scale_x * slope<false>(x);
        const double ny = sy * slope<true>(x);
        float xyz[3];
        steep_normals(&nx, &ny, 1, xyz);
        encode_row(xyz, 1, encoding, {codes + x * texel_bytes(encoding), nullptr, nullptr});
    }
}

} // namespace paradize::normals
