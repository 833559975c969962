#include "filter/destep.hpp"

#include "parallel.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace paradize::filter {
namespace {

constexpr std::size_t levels_at_most = 8;
constexpr int sweeps = 50;        // per level
constexpr float gentle = 0.7F;    // steps per texel^2: where the source's bend halves its weight
constexpr float rate = 1.0F / 32; // one over the largest eigenvalue of the squared second differences
constexpr std::size_t pad = 2;    // texels beyond a line's ends that a pass reads
// A sweep of fewer texels ends before another thread has begun; there are 50 sweeps in each of the levels.
constexpr std::size_t texels_for_threads = 1 << 14;

struct Grid {
    std::size_t rows;
    std::size_t columns;
    bool wrap_x;
    bool wrap_y;

    std::size_t size() const { return rows * columns; }
    // The row at y, perhaps outside: round the map, or the edge's own.
    std::size_t row(std::ptrdiff_t y) const { return place(y, rows, wrap_y); }

    static std::size_t place(std::ptrdiff_t i, std::size_t n, bool wrap) {
        const auto size = static_cast<std::ptrdiff_t>(n);
        return static_cast<std::size_t>(wrap ? ((i % size) + size) % size
                                             : std::clamp<std::ptrdiff_t>(i, 0, size - 1));
    }
};

// The line with `pad` texels more at both ends; index 0 of the result is its first texel.
const float *padded(const float *line, const Grid &grid, std::vector<float> &scratch) {
    scratch.resize(grid.columns + 2 * pad);
    std::copy(line, line + grid.columns, scratch.begin() + pad);
    for (std::size_t k = 1; k <= pad; ++k) {
        const auto left = -static_cast<std::ptrdiff_t>(k);
        const auto right = static_cast<std::ptrdiff_t>(grid.columns + k - 1);
        scratch[pad - k] = line[Grid::place(left, grid.columns, grid.wrap_x)];
        scratch[pad + grid.columns + k - 1] = line[Grid::place(right, grid.columns, grid.wrap_x)];
    }
    return scratch.data() + pad;
}

// Five texels weighted a b c b a, from five lines or from one line at five offsets.
PARADIZE_CLONES void five(const float *__restrict m2, const float *__restrict m1, const float *__restrict m0,
                          const float *__restrict p1, const float *__restrict p2, float a, float b, float c,
                          std::size_t n, float *__restrict to) {
    for (std::size_t x = 0; x < n; ++x) {
        to[x] = a * (m2[x] + p2[x]) + b * (m1[x] + p1[x]) + c * m0[x];
    }
}

// weight * (above - 2 here + below).
PARADIZE_CLONES void bend(const float *__restrict above, const float *__restrict here,
                          const float *__restrict below, const float *__restrict weight, std::size_t n,
                          float *__restrict to) {
    for (std::size_t x = 0; x < n; ++x) {
        to[x] = weight[x] * ((above[x] - here[x]) + (below[x] - here[x]));
    }
}

// Squared bends along both axes, in squared units of 1 / inverse.
PARADIZE_CLONES void bend_squares(const float *__restrict above, const float *__restrict here,
                                  const float *__restrict below, float inverse, std::size_t n,
                                  float *__restrict to) {
    for (std::size_t x = 0; x < n; ++x) {
        const float *h = here + x;
        const float bx = ((*(h - 1) - h[0]) + (h[1] - h[0])) * inverse;
        const float by = ((above[x] - h[0]) + (below[x] - h[0])) * inverse;
        to[x] = bx * bx + by * by;
    }
}

PARADIZE_CLONES void weigh(std::size_t n, float *__restrict energy) {
    constexpr float inverse = 1.0F / (gentle * gentle);
    for (std::size_t x = 0; x < n; ++x) {
        const float e = std::min(energy[x] * inverse, 1e12F);
        energy[x] = 1.0F / (1.0F + e * e * e);
    }
}

// One projected gradient step of a row; bx, by0, by1, by2: weighted bends along x and of three rows along y.
PARADIZE_CLONES void descend(const float *__restrict y, const float *__restrict bx,
                             const float *__restrict by0, const float *__restrict by1,
                             const float *__restrict by2, const float *__restrict source, float half,
                             float momentum, std::size_t n, float *__restrict v, float *__restrict next) {
    for (std::size_t x = 0; x < n; ++x) {
        const float *b = bx + x;
        const float slope = ((*(b - 1) - b[0]) + (b[1] - b[0])) + ((by0[x] - by1[x]) + (by2[x] - by1[x]));
        const float low = source[x] - half;
        const float high = source[x] + half;
        float value = y[x] - rate * slope;
        value = value < low ? low : value;
        value = value > high ? high : value;
        next[x] = value + momentum * (value - v[x]);
        v[x] = value;
    }
}

class Level {
  public:
    Level(const Grid &grid, std::span<const float> source, float step, int threads)
        : grid_(grid), source_(source), step_(step), threads_(grid.size() < texels_for_threads ? 1 : threads),
          weight_(grid.size()), y_(grid.size()), next_(grid.size()) {
        weigh_bends();
    }

    // Lowers v's bending; v comes within half a step of the source, or is taken there first.
    void solve(std::span<float> v) {
        const float half = 0.5F * step_;
        for_rows(grid_.size(), threads_, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const float away = std::clamp(v[i] - source_[i], -half, half);
                v[i] = source_[i] + weight_[i] * away;
                y_[i] = v[i];
            }
        });
        double t = 1.0;
        for (int sweep = 0; sweep < sweeps; ++sweep) {
            const double later = (1.0 + std::sqrt(1.0 + 4.0 * t * t)) / 2.0;
            const auto momentum = static_cast<float>((t - 1.0) / later);
            t = later;
            for_rows(grid_.rows, threads_, [&](std::size_t first, std::size_t last) {
                sweep_rows(v, half, momentum, first, last);
            });
            y_.swap(next_);
        }
    }

  private:
    const float *row(const std::vector<float> &plane, std::ptrdiff_t y) const {
        return &plane[grid_.row(y) * grid_.columns];
    }

    // weight_ = 1 / (1 + (e / gentle^2)^3) with e the squared bends of the softened source, averaged over 5
    // x 5.
    void weigh_bends() {
        const std::size_t n = grid_.columns;
        const auto across = [&](const float *from, float a, float b, float c, std::vector<float> &scratch,
                                float *to) {
            const float *line = padded(from, grid_, scratch);
            five(line - 2, line - 1, line, line + 1, line + 2, a, b, c, n, to);
        };
        const auto down = [&](const std::vector<float> &from, std::ptrdiff_t y, float a, float b, float c,
                              float *to) {
            five(row(from, y - 2), row(from, y - 1), row(from, y), row(from, y + 1), row(from, y + 2), a, b,
                 c, n, to);
        };
        const auto each_row = [&](const auto &work) {
            for_rows(grid_.rows, threads_, [&](std::size_t first, std::size_t last) {
                std::vector<float> scratch;
                for (std::size_t y = first; y < last; ++y) {
                    work(y, scratch);
                }
            });
        };
        each_row([&](std::size_t y, std::vector<float> &scratch) {
            across(&source_[y * n], 0.0625F, 0.25F, 0.375F, scratch, &y_[y * n]);
        });
        each_row([&](std::size_t y, std::vector<float> &) {
            down(y_, static_cast<std::ptrdiff_t>(y), 0.0625F, 0.25F, 0.375F, &next_[y * n]);
        });
        each_row([&](std::size_t y, std::vector<float> &scratch) {
            const auto at = static_cast<std::ptrdiff_t>(y);
            const float *here = padded(row(next_, at), grid_, scratch);
            bend_squares(row(next_, at - 1), here, row(next_, at + 1), 1.0F / step_, n, &y_[y * n]);
        });
        each_row([&](std::size_t y, std::vector<float> &scratch) {
            across(&y_[y * n], 0.2F, 0.2F, 0.2F, scratch, &next_[y * n]);
        });
        each_row([&](std::size_t y, std::vector<float> &) {
            float *to = &weight_[y * n];
            down(next_, static_cast<std::ptrdiff_t>(y), 0.2F, 0.2F, 0.2F, to);
            weigh(n, to);
        });
    }

    // The weighted bend along y of row y: none at an edge where the map ends.
    void bend_along_y(std::ptrdiff_t y, std::vector<float> &to) const {
        const auto last = static_cast<std::ptrdiff_t>(grid_.rows) - 1;
        if (!grid_.wrap_y && (y <= 0 || y >= last)) {
            std::fill(to.begin(), to.end(), 0.0F);
            return;
        }
        bend(row(y_, y - 1), row(y_, y), row(y_, y + 1), row(weight_, y), grid_.columns, to.data());
    }

    void sweep_rows(std::span<float> v, float half, float momentum, std::size_t first, std::size_t last) {
        const std::size_t n = grid_.columns;
        std::vector<float> by0(n);
        std::vector<float> by1(n);
        std::vector<float> by2(n);
        std::vector<float> bx(n);
        std::vector<float> scratch;
        std::vector<float> bent;
        const auto start = static_cast<std::ptrdiff_t>(first);
        bend_along_y(start - 1, by1);
        bend_along_y(start, by2);
        for (std::size_t y = first; y < last; ++y) {
            by0.swap(by1);
            by1.swap(by2);
            bend_along_y(static_cast<std::ptrdiff_t>(y) + 1, by2);
            const float *here = padded(&y_[y * n], grid_, scratch);
            bend(here - 1, here, here + 1, &weight_[y * n], n, bx.data());
            if (!grid_.wrap_x) {
                bx.front() = 0.0F;
                bx.back() = 0.0F;
            }
            descend(here, line_of_bends(bx, bent), by0.data(), by1.data(), by2.data(), &source_[y * n], half,
                    momentum, n, &v[y * n], &next_[y * n]);
        }
    }

    // Bends along x with one more at each end: round the map, or zero.
    const float *line_of_bends(const std::vector<float> &bx, std::vector<float> &scratch) const {
        const float *line = padded(bx.data(), grid_, scratch);
        if (!grid_.wrap_x) {
            scratch[pad - 1] = 0.0F;
            scratch[pad + grid_.columns] = 0.0F;
        }
        return line;
    }

    Grid grid_;
    std::span<const float> source_;
    float step_;
    int threads_;
    std::vector<float> weight_;
    std::vector<float> y_; // where the next gradient is taken
    std::vector<float> next_;
};

Grid coarser(const Grid &grid) {
    return {(grid.rows + 1) / 2, (grid.columns + 1) / 2, grid.wrap_x, grid.wrap_y};
}

// Means of 2 x 2; a last odd row or column counts twice.
std::vector<float> halve(std::span<const float> from, const Grid &fine, int threads) {
    const Grid coarse = coarser(fine);
    std::vector<float> to(coarse.size());
    for_rows(coarse.rows, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y) {
            const float *a = &from[2 * y * fine.columns];
            const float *b = 2 * y + 1 < fine.rows ? a + fine.columns : a;
            for (std::size_t x = 0; x < coarse.columns; ++x) {
                const std::size_t right = std::min(2 * x + 1, fine.columns - 1);
                to[y * coarse.columns + x] = 0.25F * ((a[2 * x] + a[right]) + (b[2 * x] + b[right]));
            }
        }
    });
    return to;
}

// Bilinear between the centres of the coarse texels.
void expand(std::span<const float> from, const Grid &coarse, const Grid &fine, std::span<float> to,
            int threads) {
    for_rows(fine.rows, threads, [&](std::size_t first, std::size_t last) {
        std::vector<float> mixed(coarse.columns);
        std::vector<float> scratch;
        for (std::size_t y = first; y < last; ++y) {
            const auto near = static_cast<std::ptrdiff_t>(y / 2);
            const float *a = &from[coarse.row(near) * coarse.columns];
            const float *b = &from[coarse.row(near + ((y & 1) != 0 ? 1 : -1)) * coarse.columns];
            for (std::size_t x = 0; x < coarse.columns; ++x) {
                mixed[x] = 0.75F * a[x] + 0.25F * b[x];
            }
            const float *line = padded(mixed.data(), coarse, scratch);
            for (std::size_t x = 0; x < fine.columns; ++x) {
                const float *c = line + x / 2;
                to[y * fine.columns + x] = 0.75F * c[0] + 0.25F * ((x & 1) != 0 ? c[1] : *(c - 1));
            }
        }
    });
}

// Every value exactly within half a step: what float rounding took beyond goes back.
void keep_within(std::span<const float> heights, double step, std::span<float> out, int threads) {
    for_rows(heights.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const double centre = heights[i];
            float v = out[i];
            // Halving the distance to the source ends at the source itself, whose distance is zero.
            while (std::abs(static_cast<double>(v) - centre) > 0.5 * step) {
                const float nearer = std::nextafter(v, heights[i]);
                v = std::abs(static_cast<double>(nearer) - centre) > 0.5 * step
                        ? static_cast<float>(0.5 * (static_cast<double>(v) + centre))
                        : nearer;
            }
            out[i] = v;
        }
    });
}

} // namespace

void destep(std::span<const float> heights, std::size_t rows, std::size_t columns, double step, bool wrap_x,
            bool wrap_y, std::span<float> out, int threads) {
    if (rows == 0 || columns == 0) {
        return;
    }
    std::vector<Grid> grids{{rows, columns, wrap_x, wrap_y}};
    std::vector<std::vector<float>> means(1); // of the finest level the heights themselves
    const auto source = [&](std::size_t level) {
        return level == 0 ? heights : std::span<const float>(means[level]);
    };
    while (grids.size() < levels_at_most && std::max(grids.back().rows, grids.back().columns) > 8) {
        means.push_back(halve(source(grids.size() - 1), grids.back(), threads));
        grids.push_back(coarser(grids.back()));
    }
    std::vector<float> v(source(grids.size() - 1).begin(), source(grids.size() - 1).end());
    for (std::size_t level = grids.size(); level-- > 0;) {
        if (level + 1 < grids.size()) {
            std::vector<float> finer(level == 0 ? 0 : grids[level].size());
            const std::span<float> to = level == 0 ? out : std::span<float>(finer);
            expand(v, grids[level + 1], grids[level], to, threads);
            v = std::move(finer);
            means[level + 1] = {};
        } else if (level == 0) {
            std::copy(v.begin(), v.end(), out.begin());
        }
        Level work(grids[level], source(level), static_cast<float>(step), threads);
        work.solve(level == 0 ? out : std::span<float>(v));
    }
    keep_within(heights, step, out, threads);
}

} // namespace paradize::filter
