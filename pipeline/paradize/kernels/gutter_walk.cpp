#include "gutter_walk.hpp"

#include "gutter_means.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace paradize::gutter {
namespace {

constexpr std::size_t most_channels = 4;
using Texel = std::array<float, most_channels>;

struct Direction {
    double x, y;
};
constexpr double diagonal = 0.70710678118654752440;
constexpr std::array<Direction, 9> directions{{{0, 0},
                                               {1, 0},
                                               {-1, 0},
                                               {0, 1},
                                               {0, -1},
                                               {diagonal, diagonal},
                                               {-diagonal, diagonal},
                                               {diagonal, -diagonal},
                                               {-diagonal, -diagonal}}};

double sign_of(double v) {
    return v > 0.0 ? 1.0 : (v < 0.0 ? -1.0 : 0.0);
}

// The texels of a border: inside, with a neighbour that is outside or another island's. Sorted by island.
std::vector<std::uint32_t> border_of(const Layout &layout, std::size_t rows, std::size_t columns,
                                     std::span<const double> reach) {
    std::vector<std::uint32_t> found;
    const auto h = static_cast<std::int64_t>(rows);
    const auto w = static_cast<std::int64_t>(columns);
    for (std::int64_t y = 0; y < h; ++y) {
        for (std::int64_t x = 0; x < w; ++x) {
            const auto here = static_cast<std::size_t>(y * w + x);
            if (layout.inside[here] == 0 || reach[static_cast<std::size_t>(layout.owner[here])] < 0.0) {
                continue;
            }
            bool edge = false;
            for (std::int64_t j = -1; j <= 1 && !edge; ++j) {
                for (std::int64_t i = -1; i <= 1 && !edge; ++i) {
                    std::int64_t nx = x + i;
                    std::int64_t ny = y + j;
                    if (layout.repeat) {
                        nx = (nx + w) % w;
                        ny = (ny + h) % h;
                    } else if (nx < 0 || nx >= w || ny < 0 || ny >= h) {
                        continue;
                    }
                    const auto there = static_cast<std::size_t>(ny * w + nx);
                    edge = layout.inside[there] == 0 || layout.owner[there] != layout.owner[here];
                }
            }
            if (edge) {
                found.push_back(static_cast<std::uint32_t>(here));
            }
        }
    }
    std::stable_sort(found.begin(), found.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return layout.owner[a] < layout.owner[b]; });
    return found;
}

struct Taps {
    std::array<std::size_t, 4> at;
    std::array<double, 4> weight;
};

std::size_t placed(std::int64_t i, std::size_t size, bool repeat) {
    const auto n = static_cast<std::int64_t>(size);
    if (repeat) {
        const std::int64_t m = i % n;
        return static_cast<std::size_t>(m < 0 ? m + n : m);
    }
    return static_cast<std::size_t>(std::clamp<std::int64_t>(i, 0, n - 1));
}

// Bilinear taps at (x, y), in texels of a level.
Taps taps_at(double x, double y, std::size_t rows, std::size_t columns, bool repeat) {
    const double left = std::floor(x - 0.5);
    const double top = std::floor(y - 0.5);
    const double fx = x - 0.5 - left;
    const double fy = y - 0.5 - top;
    Taps taps{};
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t i = k % 2;
        const std::size_t j = k / 2;
        const std::size_t column =
            placed(static_cast<std::int64_t>(left) + static_cast<std::int64_t>(i), columns, repeat);
        const std::size_t row =
            placed(static_cast<std::int64_t>(top) + static_cast<std::int64_t>(j), rows, repeat);
        taps.at[k] = row * columns + column;
        taps.weight[k] = (i != 0 ? fx : 1.0 - fx) * (j != 0 ? fy : 1.0 - fy);
    }
    return taps;
}

double half_chord(const std::array<double, 4> &a, const std::array<double, 4> &b) {
    const double za = std::sqrt(std::max(0.0, 1.0 - a[0] * a[0] - a[1] * a[1]));
    const double zb = std::sqrt(std::max(0.0, 1.0 - b[0] * b[0] - b[1] * b[1]));
    const double x = a[0] - b[0];
    const double y = a[1] - b[1];
    return 0.5 * std::sqrt(x * x + y * y + (za - zb) * (za - zb));
}

double difference(const std::array<double, 4> &seen, const std::array<double, 4> &own, Kind kind,
                  std::size_t channels) {
    if (kind == Kind::normal) {
        return half_chord(seen, own);
    }
    double largest = 0.0;
    const std::size_t count = kind == Kind::color ? std::min<std::size_t>(channels, 3) : channels;
    for (std::size_t c = 0; c < count; ++c) {
        const double gap = kind == Kind::color
                               ? std::sqrt(std::max(seen[c], 0.0)) - std::sqrt(std::max(own[c], 0.0))
                               : seen[c] - own[c];
        largest = std::max(largest, std::abs(gap));
    }
    return kind == Kind::color && channels == 4 ? largest * std::clamp(own[3], 0.0, 1.0) : largest;
}

Found judged(std::vector<float> &errors, const std::vector<float> &shares,
             const std::vector<std::uint32_t> &border, const Layout &layout, std::size_t columns) {
    constexpr std::size_t each = directions.size();
    Found found;
    found.samples = static_cast<std::int64_t>(errors.size());
    if (errors.empty()) {
        return found;
    }
    const auto worst = std::max_element(errors.begin(), errors.end());
    found.worst = static_cast<double>(*worst);
    found.own = static_cast<double>(shares[static_cast<std::size_t>(worst - errors.begin())]);
    const std::uint32_t texel = border[static_cast<std::size_t>(worst - errors.begin()) / each];
    found.x = static_cast<std::int64_t>(texel % columns);
    found.y = static_cast<std::int64_t>(texel / columns);
    const auto percentile = [](auto first, auto last) {
        const auto at = first + (last - first - 1) * 99 / 100;
        std::nth_element(first, at, last);
        return static_cast<double>(*at);
    };
    for (std::size_t begin = 0; begin < border.size();) {
        std::size_t end = begin;
        while (end < border.size() && layout.owner[border[end]] == layout.owner[border[begin]]) {
            ++end;
        }
        const auto first = errors.begin() + static_cast<std::ptrdiff_t>(begin * each);
        const auto last = errors.begin() + static_cast<std::ptrdiff_t>(end * each);
        double sum = 0.0;
        for (auto it = first; it != last; ++it) {
            sum += static_cast<double>(*it);
        }
        const double p99 = percentile(first, last);
        if (found.island < 0 || p99 > found.p99) {
            found.p99 = p99;
            found.mean = sum / static_cast<double>(last - first);
            found.island = layout.owner[border[begin]];
        }
        begin = end;
    }
    found.all_p99 = percentile(errors.begin(), errors.end());
    return found;
}

// One level on its way: its texels, and what each should hold.
struct Level {
    const float *texels;
    std::size_t rows, columns, channels;
    const Means &means;
};

struct Sample {
    float error = 0.0F;
    float share = 0.0F; // how much of it is the island's own
};

// At (x, y) in texels of the level. home: what the island holds where the sample comes from, which stands for
// its own where it sees nothing of it any more.
Sample sampled(const Level &level, double x, double y, std::int32_t island, Kind kind, bool repeat,
               const Texel &home) {
    const Taps taps = taps_at(x, y, level.rows, level.columns, repeat);
    std::array<double, 4> seen{};
    std::array<double, 4> own{};
    double weight = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        if (taps.weight[k] == 0.0) {
            continue;
        }
        const float *value = level.texels + taps.at[k] * level.channels;
        Texel mean{};
        const double share =
            taps.weight[k] * level.means.own(taps.at[k], island, value, level.channels, mean);
        for (std::size_t c = 0; c < level.channels; ++c) {
            seen[c] += taps.weight[k] * static_cast<double>(value[c]);
            own[c] += share * static_cast<double>(mean[c]);
        }
        weight += share;
    }
    for (std::size_t c = 0; c < level.channels; ++c) {
        own[c] = weight > 1e-9 ? own[c] / weight : static_cast<double>(home[c]);
    }
    return {static_cast<float>(difference(seen, own, kind, level.channels)), static_cast<float>(weight)};
}

} // namespace

std::vector<Found> walk(const Chain &chain, Kind kind, const Layout &layout, std::span<const double> reach,
                        int threads) {
    const std::vector<std::uint32_t> border = border_of(layout, chain.rows, chain.columns, reach);
    constexpr std::size_t each = directions.size();
    std::vector<Found> found;
    std::vector<float> errors(border.size() * each);
    std::vector<float> shares(errors.size());
    const auto width = static_cast<double>(chain.columns);
    const auto height = static_cast<double>(chain.rows);
    std::size_t rows = chain.rows;
    std::size_t columns = chain.columns;
    const float *texels = chain.texels.data();
    Means means(chain, kind, layout);
    const Means first = means;
    while (true) {
        const Level level{texels, rows, columns, chain.channels, means};
        const double sx = static_cast<double>(columns) / width;
        const double sy = static_cast<double>(rows) / height;
        for_rows(border.size(), threads, [&](std::size_t from, std::size_t to) {
            for (std::size_t b = from; b < to; ++b) {
                const std::size_t texel = border[b];
                const std::int32_t island = layout.owner[texel];
                const double far = reach[static_cast<std::size_t>(island)];
                const double cx = static_cast<double>(texel % chain.columns) + 0.5;
                const double cy = static_cast<double>(texel / chain.columns) + 0.5;
                Texel home{};
                first.own(texel, island, chain.texels.data() + texel * chain.channels, chain.channels, home);
                for (std::size_t d = 0; d < each; ++d) {
                    // The texel's edge, half a pixel (half a texel of this level) beyond, and the reach.
                    const Direction &way = directions[d];
                    const double x = cx + 0.5 * sign_of(way.x) + (0.5 / sx + far * width) * way.x;
                    const double y = cy + 0.5 * sign_of(way.y) + (0.5 / sy + far * height) * way.y;
                    const Sample sample = sampled(level, x * sx, y * sy, island, kind, layout.repeat, home);
                    errors[b * each + d] = sample.error;
                    shares[b * each + d] = sample.share;
                }
            }
        });
        found.push_back(judged(errors, shares, border, layout, chain.columns));
        if (found.size() == chain.levels) {
            return found;
        }
        texels += rows * columns * chain.channels;
        means = means.halved();
        rows = std::max<std::size_t>(1, rows / 2);
        columns = std::max<std::size_t>(1, columns / 2);
    }
}

} // namespace paradize::gutter
