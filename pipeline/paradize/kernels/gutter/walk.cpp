#include "gutter/walk.hpp"

#include "gutter/means.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace paradize::gutter {
namespace {

using Texel = std::array<float, 4>;

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

struct Taps {
    std::array<std::size_t, 4> at;
    std::array<double, 4> weight;
};

std::size_t placed(std::int64_t i, std::size_t size, bool repeat) {
    const auto n = static_cast<std::int64_t>(size);
    if (i >= 0 && i < n) {
        return static_cast<std::size_t>(i);
    }
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
    const auto i = static_cast<std::int64_t>(left);
    const auto j = static_cast<std::int64_t>(top);
    const std::size_t a = placed(i, columns, repeat);
    const std::size_t b = placed(i + 1, columns, repeat);
    const std::size_t first = placed(j, rows, repeat) * columns;
    const std::size_t second = placed(j + 1, rows, repeat) * columns;
    return {{first + a, first + b, second + a, second + b},
            {(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy}};
}

double half_chord(const std::array<double, 4> &a, const std::array<double, 4> &b) {
    const double za = std::sqrt(std::max(0.0, 1.0 - a[0] * a[0] - a[1] * a[1]));
    const double zb = std::sqrt(std::max(0.0, 1.0 - b[0] * b[0] - b[1] * b[1]));
    const double x = a[0] - b[0];
    const double y = a[1] - b[1];
    return 0.5 * std::sqrt(x * x + y * y + (za - zb) * (za - zb));
}

template <std::size_t channels>
double difference(Kind kind, const std::array<double, 4> &seen, const std::array<double, 4> &own) {
    if (kind == Kind::normal) {
        return half_chord(seen, own);
    }
    double largest = 0.0;
    for (std::size_t c = 0; c < colors<channels>(kind); ++c) {
        const double gap = kind == Kind::color
                               ? std::sqrt(std::max(seen[c], 0.0)) - std::sqrt(std::max(own[c], 0.0))
                               : seen[c] - own[c];
        largest = std::max(largest, std::abs(gap));
    }
    return has_alpha<channels>(kind) ? largest * std::clamp(own[3], 0.0, 1.0) : largest;
}

LevelBleed judged(std::vector<float> &errors, const std::vector<float> &shares,
                  const std::vector<std::uint32_t> &border, const Layout &layout, std::size_t columns) {
    constexpr std::size_t each = directions.size();
    LevelBleed found;
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

struct Sample {
    float error = 0.0F;
    float share = 0.0F; // how much of it is the island's own
};

// Of a level's texels at (x, y), in texels of it. means: what each should hold, a Finest or Means. home: what
// the island holds where the sample comes from, which stands for its own where it sees nothing of it any
// more.
template <std::size_t channels, typename Held>
Sample sampled(Kind kind, const float *texels, const Held &means, double x, double y, std::int32_t island,
               bool repeat, const float *home) {
    const Taps taps = taps_at(x, y, means.rows, means.columns, repeat);
    std::array<double, 4> seen{};
    std::array<double, 4> own{};
    double weight = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        if (taps.weight[k] == 0.0) {
            continue;
        }
        const float *value = texels + taps.at[k] * channels;
        Texel mean{};
        const double share =
            taps.weight[k] * means.template own<channels>(kind, taps.at[k], island, value, mean);
        for (std::size_t c = 0; c < channels; ++c) {
            seen[c] += taps.weight[k] * static_cast<double>(value[c]);
            own[c] += share * static_cast<double>(mean[c]);
        }
        weight += share;
    }
    for (std::size_t c = 0; c < channels; ++c) {
        own[c] = weight > 1e-9 ? own[c] / weight : static_cast<double>(home[c]);
    }
    return {static_cast<float>(difference<channels>(kind, seen, own)), static_cast<float>(weight)};
}

// A chain's borders on their way through its levels.
template <std::size_t channels>
class Walk {
  public:
    Walk(const Chain &chain, Kind kind, const Layout &layout, std::vector<std::uint32_t> border,
         std::span<const double> reach, int threads)
        : chain_(chain), kind_(kind), layout_(layout), border_(std::move(border)), reach_(reach),
          threads_(threads), errors_(border_.size() * directions.size()), shares_(errors_.size()) {}

    std::vector<LevelBleed> all() {
        const Finest<channels> finest(chain_, kind_, layout_);
        std::vector<LevelBleed> found{at(chain_.levels[0], finest)};
        if (chain_.levels.size() > 1) {
            Means means = Means::halved(finest);
            found.push_back(at(chain_.levels[1], means));
            for (const float *texels : chain_.levels.subspan(2)) {
                means = Means::halved(means);
                found.push_back(at(texels, means));
            }
        }
        return found;
    }

  private:
    template <typename Held>
    LevelBleed at(const float *texels, const Held &means) {
        constexpr std::size_t each = directions.size();
        const auto width = static_cast<double>(chain_.columns);
        const auto height = static_cast<double>(chain_.rows);
        const double sx = static_cast<double>(means.columns) / width;
        const double sy = static_cast<double>(means.rows) / height;
        for_rows(border_.size(), threads_, [&](std::size_t from, std::size_t to) {
            for (std::size_t b = from; b < to; ++b) {
                const std::size_t texel = border_[b];
                const std::int32_t island = layout_.owner[texel];
                const double far = reach_[static_cast<std::size_t>(island)];
                const double cx = static_cast<double>(texel % chain_.columns) + 0.5;
                const double cy = static_cast<double>(texel / chain_.columns) + 0.5;
                const float *home = chain_.levels[0] + texel * channels; // inside: as it is
                for (std::size_t d = 0; d < each; ++d) {
                    // The texel's edge, half a pixel (half a texel of this level) beyond, and the reach.
                    const Direction &way = directions[d];
                    const double x = cx + 0.5 * sign_of(way.x) + (0.5 / sx + far * width) * way.x;
                    const double y = cy + 0.5 * sign_of(way.y) + (0.5 / sy + far * height) * way.y;
                    const Sample sample =
                        sampled<channels>(kind_, texels, means, x * sx, y * sy, island, layout_.repeat, home);
                    errors_[b * each + d] = sample.error;
                    shares_[b * each + d] = sample.share;
                }
            }
        });
        return judged(errors_, shares_, border_, layout_, chain_.columns);
    }

    const Chain &chain_;
    const Kind kind_;
    const Layout &layout_;
    std::vector<std::uint32_t> border_;
    std::span<const double> reach_;
    int threads_;
    std::vector<float> errors_;
    std::vector<float> shares_;
};

} // namespace

std::vector<std::uint32_t> border_of(const Layout &layout, std::size_t rows, std::size_t columns) {
    std::vector<std::uint32_t> found;
    const auto h = static_cast<std::int64_t>(rows);
    const auto w = static_cast<std::int64_t>(columns);
    for (std::int64_t y = 0; y < h; ++y) {
        for (std::int64_t x = 0; x < w; ++x) {
            const auto here = static_cast<std::size_t>(y * w + x);
            if (layout.inside[here] == 0) {
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

std::vector<LevelBleed> walk(const Chain &chain, Kind kind, const Layout &layout,
                             std::span<const std::uint32_t> border, std::span<const double> reach,
                             int threads) {
    std::vector<std::uint32_t> walked;
    walked.reserve(border.size());
    std::ranges::copy_if(border, std::back_inserter(walked), [&](std::uint32_t texel) {
        return !(reach[static_cast<std::size_t>(layout.owner[texel])] < 0.0);
    });
    switch (chain.channels) {
    case 1:
        return Walk<1>(chain, kind, layout, std::move(walked), reach, threads).all();
    case 2:
        return Walk<2>(chain, kind, layout, std::move(walked), reach, threads).all();
    case 3:
        return Walk<3>(chain, kind, layout, std::move(walked), reach, threads).all();
    default:
        return Walk<4>(chain, kind, layout, std::move(walked), reach, threads).all();
    }
}

} // namespace paradize::gutter
