#include "gutter/walk.hpp"

#include <algorithm>
#include <cmath>

#include "math/disjoint_sets.hpp"

namespace paradize::gutter {
namespace {

// Calls with(here, there) for every pair of texels that share an edge, also over the map's edge when it
// repeats.
template <typename With>
void neighbours(std::size_t rows, std::size_t columns, bool repeat, With &&with) {
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            const std::size_t here = y * columns + x;
            if (x + 1 < columns || repeat) {
                with(here, y * columns + (x + 1) % columns);
            }
            if (y + 1 < rows || repeat) {
                with(here, (y + 1) % rows * columns + x);
            }
        }
    }
}

double apart(std::size_t a, std::size_t b, std::size_t size, bool repeat) {
    const std::size_t d = a > b ? a - b : b - a;
    return static_cast<double>(repeat ? std::min(d, size - d) : d);
}

} // namespace

std::vector<std::int32_t> touching(std::span<const std::int32_t> ids, std::size_t rows, std::size_t columns,
                                   std::size_t count, bool repeat) {
    DisjointSets islands(count);
    neighbours(rows, columns, repeat, [&](std::size_t here, std::size_t there) {
        if (ids[here] >= 0 && ids[there] >= 0 && ids[here] != ids[there]) {
            islands.join(static_cast<std::uint32_t>(ids[here]), static_cast<std::uint32_t>(ids[there]));
        }
    });
    std::vector<std::int32_t> names(count, -1);
    std::int32_t next = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t r = islands.root(i);
        if (names[r] < 0) {
            names[r] = next++;
        }
        names[i] = names[r];
    }
    return names;
}

double smallest_gap(const Layout &layout, std::size_t rows, std::size_t columns,
                    std::span<std::int64_t, 2> pair) {
    double smallest = -1.0;
    pair[0] = pair[1] = -1;
    neighbours(rows, columns, layout.repeat, [&](std::size_t here, std::size_t there) {
        if (layout.owner[here] == layout.owner[there]) {
            return;
        }
        const auto a = static_cast<std::size_t>(layout.source[here]);
        const auto b = static_cast<std::size_t>(layout.source[there]);
        const double x = apart(a % columns, b % columns, columns, layout.repeat);
        const double y = apart(a / columns, b / columns, rows, layout.repeat);
        const double gap = std::sqrt(x * x + y * y) - 1.0;
        if (smallest < 0.0 || gap < smallest) {
            smallest = gap;
            pair[0] = static_cast<std::int64_t>(a);
            pair[1] = static_cast<std::int64_t>(b);
        }
    });
    return smallest;
}

} // namespace paradize::gutter
