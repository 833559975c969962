#include "maps/gutter.hpp"

#include "math/disjoint_sets.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

namespace paradize::maps {
namespace {

constexpr double most_looks = 8.0; // of each texel, on the mean
constexpr std::int64_t far_away = std::int64_t{1} << 30;

// A triangle in texels, counter-clockwise in a plane whose y grows upwards.
struct Triangle {
    std::array<double, 3> x;
    std::array<double, 3> y;

    double area() const { return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]); }

    // The longer extent of the side that begins at corner a.
    double side(std::size_t a) const {
        const std::size_t b = (a + 1) % 3;
        return std::max(std::abs(x[b] - x[a]), std::abs(y[b] - y[a]));
    }

    // The columns from `left` to `right` in row j where a texel's square may have a part inside; `slack` 0.5:
    // the square, 0: its centre. A texel too many at either end, so that rounding leaves none out.
    std::pair<double, double> span(double j, double left, double right, double slack) const {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto [nx, ny, reach] = edge(a, slack);
            if (std::abs(nx) <= 1e-6 * std::abs(ny)) {
                continue; // along the row
            }
            const double at = x[a] - 0.5 - (ny * (j + 0.5 - y[a]) + reach) / nx;
            if (nx > 0.0) {
                left = std::max(left, std::floor(at) - 1.0);
            } else {
                right = std::min(right, std::ceil(at) + 2.0);
            }
        }
        return {left, right};
    }

    // Whether the texel at (i, j) has a part inside.
    bool covers(double i, double j, double slack) const {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto [nx, ny, reach] = edge(a, slack);
            const double at = nx * (i + 0.5 - x[a]) + ny * (j + 0.5 - y[a]);
            if (slack > 0.0 ? at + reach <= 0.0 : at < 0.0) {
                return false;
            }
        }
        return true;
    }

  private:
    // The inward normal of the edge that begins at corner a, and how far along it a texel reaches.
    std::array<double, 3> edge(std::size_t a, double slack) const {
        const std::size_t b = (a + 1) % 3;
        const double nx = y[a] - y[b];
        const double ny = x[b] - x[a];
        return {nx, ny, slack * (std::abs(nx) + std::abs(ny))};
    }
};

std::size_t wrapped(double i, std::size_t size) {
    const auto n = static_cast<double>(size);
    const double m = i - n * std::floor(i / n);
    return std::min(static_cast<std::size_t>(m), size - 1);
}

// The tiles, in texels, that a coordinate's range lies in: an end that falls on a border is inside.
std::pair<double, double> tiles_of(std::pair<double, double> range, std::size_t size) {
    const auto n = static_cast<double>(size);
    const double end = std::ceil(range.second / n);
    const double last = range.first >= 0.0 ? std::max(1.0, end) : end;
    const double first = std::min(std::floor(range.first / n), last - 1.0);
    return {first * n, last * n - 1.0};
}

// Calls with(column, row) for the texels that bilinear samples read on a triangle without area: along its
// longest side, or at its point.
template <typename With>
void along(const Triangle &triangle, std::size_t rows, std::size_t columns, With &&with) {
    std::size_t from = 0;
    double longest = -1.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double length = triangle.side(k);
        if (length > longest) {
            longest = length;
            from = k;
        }
    }
    const std::size_t to = (from + 1) % 3;
    const auto [left, right] = tiles_of(std::minmax({triangle.x[0], triangle.x[1], triangle.x[2]}), columns);
    const auto [top, bottom] = tiles_of(std::minmax({triangle.y[0], triangle.y[1], triangle.y[2]}), rows);
    const double steps = std::ceil(4.0 * longest);
    for (double step = 0.0; step <= steps; step += 1.0) {
        const double share = steps > 0.0 ? step / steps : 0.0;
        const double x = triangle.x[from] + (triangle.x[to] - triangle.x[from]) * share - 0.5;
        const double y = triangle.y[from] + (triangle.y[to] - triangle.y[from]) * share - 0.5;
        for (double j = std::floor(y); j <= std::ceil(y); j += 1.0) {
            for (double i = std::floor(x); i <= std::ceil(x); i += 1.0) {
                with(std::clamp(i, left, right), std::clamp(j, top, bottom));
            }
        }
    }
}

// The texels of each row that no triangle holds yet. Where triangles lie over one another, looking for these
// costs less than looking at all; elsewhere it costs more.
class FreeTexels {
  public:
    FreeTexels(std::span<const std::int32_t> held, std::size_t rows, std::size_t columns)
        : length_(columns + 1), next_(rows * length_) {
        for (std::size_t k = 0; k < next_.size(); ++k) {
            const std::size_t row = k / length_, column = k % length_;
            const bool taken = column < columns && held[row * columns + column] >= 0;
            next_[k] = static_cast<std::uint32_t>(taken ? column + 1 : column);
        }
    }

    // The first free texel of a row from a column on; the number of columns where there is none.
    std::size_t from(std::size_t row, std::size_t column) {
        std::uint32_t *const next = next_.data() + row * length_;
        while (next[column] != column) {
            next[column] = next[next[column]];
            column = next[column];
        }
        return column;
    }

    void take(std::size_t row, std::size_t column) { ++next_[row * length_ + column]; }

  private:
    std::size_t length_;
    std::vector<std::uint32_t> next_; // a column further on, or the column itself where it is free
};

// Along one line: the lower envelope of the parabolas g(k)^2 + (i - k)^2.
class Envelope {
  public:
    explicit Envelope(std::size_t size) : apex_(size), from_(size) {}

    // distance[k]: to the nearest covered texel within column k, far_away where there is none.
    void build(std::span<const std::int64_t> distance) {
        count_ = 0;
        const auto size = static_cast<std::int64_t>(distance.size());
        for (std::int64_t u = 0; u < size; ++u) {
            const std::int64_t g = distance[static_cast<std::size_t>(u)];
            if (g >= far_away) {
                continue;
            }
            while (count_ > 0) {
                const std::int64_t s = apex_[count_ - 1];
                const std::int64_t at = from_[count_ - 1];
                if (value(distance, s, at) <= value(distance, u, at)) {
                    break;
                }
                --count_;
            }
            if (count_ == 0) {
                apex_[0] = u;
                from_[0] = 0;
                count_ = 1;
                continue;
            }
            const std::int64_t s = apex_[count_ - 1];
            const std::int64_t gs = distance[static_cast<std::size_t>(s)];
            const std::int64_t numerator = u * u - s * s + g * g - gs * gs;
            const std::int64_t denominator = 2 * (u - s);
            std::int64_t cut = numerator / denominator;
            if (numerator % denominator < 0) {
                --cut; // floor
            }
            if (cut + 1 < size) {
                apex_[count_] = u;
                from_[count_] = cut + 1;
                ++count_;
            }
        }
    }

    // Calls with(i, the column whose covered texel is nearest to column i; -1 where there is none) for i in
    // [first, last).
    template <typename With>
    void nearest(std::size_t first, std::size_t last, With &&with) const {
        std::size_t k = 0;
        for (std::size_t i = first; i < last; ++i) {
            while (k + 1 < count_ && from_[k + 1] <= static_cast<std::int64_t>(i)) {
                ++k;
            }
            with(i, count_ == 0 ? -1 : apex_[k]);
        }
    }

  private:
    static std::int64_t value(std::span<const std::int64_t> distance, std::int64_t apex, std::int64_t at) {
        const std::int64_t g = distance[static_cast<std::size_t>(apex)];
        return g * g + (at - apex) * (at - apex);
    }

    std::vector<std::int64_t> apex_;
    std::vector<std::int64_t> from_;
    std::size_t count_ = 0;
};

} // namespace

std::vector<std::int32_t> uv_islands(std::span<const float> uvs, std::span<const std::uint32_t> triangles) {
    const std::size_t points = uvs.size() / 2;
    std::vector<std::uint32_t> order(points);
    std::iota(order.begin(), order.end(), 0U);
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(uvs[2 * a], uvs[2 * a + 1]) < std::pair(uvs[2 * b], uvs[2 * b + 1]);
    };
    std::sort(order.begin(), order.end(), less);
    DisjointSets islands(points);
    for (std::size_t i = 1; i < points; ++i) {
        if (!less(order[i - 1], order[i])) {
            islands.join(order[i], order[i - 1]);
        }
    }
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
        for (std::size_t k = 1; k < 3; ++k) {
            islands.join(triangles[t + k], triangles[t]);
        }
    }
    std::vector<std::int32_t> name(points, -1);
    std::vector<std::int32_t> out(triangles.size() / 3);
    std::int32_t next = 0;
    for (std::size_t t = 0; t < out.size(); ++t) {
        std::int32_t &id = name[islands.root(triangles[3 * t])];
        if (id < 0) {
            id = next++;
        }
        out[t] = id;
    }
    return out;
}

void rasterise(std::span<const float> uvs, std::span<const std::uint32_t> triangles,
               std::span<const std::int32_t> ids, std::size_t rows, std::size_t columns, double work_limit,
               std::span<std::int32_t> out, bool touched) {
    std::fill(out.begin(), out.end(), -1);
    std::optional<FreeTexels> free; // once the texels' own number was looked at several times
    double work = 0.0, looked_at = 0.0;
    const auto require = [](bool enough) {
        if (!enough) {
            throw std::length_error("the UVs tile too often to be drawn into a map");
        }
    };
    for (const double slack : {0.0, 0.5}) {
        if (slack > 0.0 && !touched) {
            break;
        }
        for (std::size_t t = 0; t < ids.size(); ++t) {
            Triangle triangle{};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t v = triangles[3 * t + k];
                triangle.x[k] = static_cast<double>(uvs[2 * v]) * static_cast<double>(columns);
                triangle.y[k] = static_cast<double>(uvs[2 * v + 1]) * static_cast<double>(rows);
            }
            const double area = triangle.area();
            if (!(area != 0.0)) {
                if (slack > 0.0) {
                    work += 16.0 * std::max({triangle.side(0), triangle.side(1), triangle.side(2)}) + 4.0;
                    require(work <= work_limit);
                    along(triangle, rows, columns, [&](double i, double j) {
                        std::int32_t &texel = out[wrapped(j, rows) * columns + wrapped(i, columns)];
                        texel = texel < 0 ? ids[t] : texel;
                    });
                }
                continue;
            }
            if (area < 0.0) {
                std::swap(triangle.x[1], triangle.x[2]);
                std::swap(triangle.y[1], triangle.y[2]);
            }
            const auto [x_low, x_high] = std::minmax({triangle.x[0], triangle.x[1], triangle.x[2]});
            const auto [y_low, y_high] = std::minmax({triangle.y[0], triangle.y[1], triangle.y[2]});
            const double left = std::floor(x_low);
            const double right = std::ceil(x_high);
            const double top = std::floor(y_low);
            const double bottom = std::ceil(y_high);
            work += (bottom - top) * (1.0 + (right - left) / static_cast<double>(columns));
            require(work <= work_limit);
            looked_at += (bottom - top) * (right - left);
            if (!free && looked_at > most_looks * static_cast<double>(out.size())) {
                free.emplace(out, rows, columns);
            }
            for (double j = top; j < bottom; j += 1.0) {
                const std::size_t row = wrapped(j, rows);
                const auto [first, last] = triangle.span(j, left, right, slack);
                const auto draw = [&](double i, std::size_t column) {
                    std::int32_t &texel = out[row * columns + column];
                    if (texel < 0 && triangle.covers(i, j, slack)) {
                        texel = ids[t];
                    }
                    return texel >= 0;
                };
                std::size_t column = wrapped(first, columns);
                if (!free) {
                    for (double i = first; i < last; i += 1.0) {
                        draw(i, column);
                        column = column + 1 < columns ? column + 1 : 0;
                    }
                    continue;
                }
                double tile = first - static_cast<double>(column); // where the row of the map begins
                column = free->from(row, column);
                while (tile + static_cast<double>(column) < last) {
                    if (column == columns) {
                        tile += static_cast<double>(columns);
                        column = free->from(row, 0);
                        continue;
                    }
                    if (draw(tile + static_cast<double>(column), column)) {
                        free->take(row, column);
                    }
                    column = free->from(row, column + 1);
                }
            }
        }
    }
}

void nearest_covered(std::span<const std::uint8_t> covered, std::size_t rows, std::size_t columns,
                     bool wrap_x, bool wrap_y, std::span<std::int32_t> out, int threads) {
    // Down every column: the row of the nearest covered texel (in the tile, or in its repetition).
    std::vector<std::int32_t> row_of(rows * columns, -1);
    const auto n = static_cast<std::int64_t>(rows);
    for_rows(columns, threads, [&](std::size_t begin, std::size_t end) {
        std::vector<std::int64_t> best(rows);
        for (std::size_t x = begin; x < end; ++x) {
            std::fill(best.begin(), best.end(), far_away);
            const std::int64_t sweeps = wrap_y ? 2 : 1;
            for (const std::int64_t step : {1, -1}) {
                std::int64_t distance = far_away;
                std::int64_t last = -1;
                for (std::int64_t k = 0; k < sweeps * n; ++k) {
                    const std::int64_t y = step > 0 ? k % n : n - 1 - k % n;
                    if (covered[static_cast<std::size_t>(y) * columns + x] != 0) {
                        distance = 0;
                        last = y;
                    } else if (last >= 0) {
                        ++distance;
                    }
                    if (last >= 0 && distance < best[static_cast<std::size_t>(y)]) {
                        best[static_cast<std::size_t>(y)] = distance;
                        row_of[static_cast<std::size_t>(y) * columns + x] = static_cast<std::int32_t>(last);
                    }
                }
            }
        }
    });
    // Along every row: which column's texel is nearest.
    for_rows(rows, threads, [&](std::size_t begin, std::size_t end) {
        const std::size_t length = wrap_x ? 3 * columns : columns;
        const std::size_t offset = wrap_x ? columns : 0;
        std::vector<std::int64_t> distance(length);
        Envelope envelope(length);
        for (std::size_t y = begin; y < end; ++y) {
            for (std::size_t k = 0; k < length; ++k) {
                const std::int32_t row = row_of[y * columns + k % columns];
                std::int64_t d = std::abs(static_cast<std::int64_t>(row) - static_cast<std::int64_t>(y));
                if (wrap_y) {
                    d = std::min(d, n - d);
                }
                distance[k] = row < 0 ? far_away : d;
            }
            envelope.build(distance);
            envelope.nearest(offset, offset + columns, [&](std::size_t i, std::int64_t column) {
                std::int32_t &to = out[y * columns + i - offset];
                if (column < 0) {
                    to = -1;
                    return;
                }
                const std::size_t at = static_cast<std::size_t>(column) % columns;
                to = static_cast<std::int32_t>(static_cast<std::size_t>(row_of[y * columns + at]) * columns +
                                               at);
            });
        }
    });
}

} // namespace paradize::maps
