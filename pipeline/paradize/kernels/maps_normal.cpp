#include "maps_normal.hpp"

#include "maps_parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace paradize::maps {
namespace {

constexpr std::size_t reach = 2; // texels on each side that a filter may touch

// A place along one axis, possibly outside: the texel to read, and for an odd reflection the texel about
// which it is reflected: h = 2 h[about] - h[at].
struct Tap {
    std::size_t at;
    std::size_t about;
    bool reflected;
};

Tap tap(std::ptrdiff_t i, std::size_t size, bool wrap) {
    const auto n = static_cast<std::ptrdiff_t>(size);
    if (wrap) {
        const std::ptrdiff_t m = ((i % n) + n) % n;
        return {static_cast<std::size_t>(m), 0, false};
    }
    if (i >= 0 && i < n) {
        return {static_cast<std::size_t>(i), 0, false};
    }
    const std::ptrdiff_t about = i < 0 ? 0 : n - 1;
    const std::ptrdiff_t mirrored = std::clamp<std::ptrdiff_t>(2 * about - i, 0, n - 1);
    return {static_cast<std::size_t>(mirrored), static_cast<std::size_t>(about), true};
}

// Rows around the current one, each with `reach` texels more on either side. Real is float, or double for
// heights whose differences could overflow.
template <typename Real>
class Window {
  public:
    Window(std::span<const float> heights, std::size_t rows, std::size_t columns,
           const NormalSettings &settings)
        : heights_(heights), rows_(rows), columns_(columns), settings_(settings) {
        for (auto &line : lines_) {
            line.resize(columns + 2 * reach);
        }
        held_.fill(std::numeric_limits<std::ptrdiff_t>::min());
    }

    // The row at y (possibly outside); valid until a row five further is asked for. Index 0 is column 0.
    const Real *row(std::ptrdiff_t y) {
        const auto slot = static_cast<std::size_t>(((y % 5) + 5) % 5);
        std::vector<Real> &line = lines_[slot];
        if (held_[slot] != y) {
            held_[slot] = y;
            fill(y, line);
        }
        return line.data() + reach;
    }

  private:
    void fill(std::ptrdiff_t y, std::vector<Real> &line) {
        const Tap source = tap(y, rows_, settings_.wrap_y);
        const float *from = &heights_[source.at * columns_];
        Real *to = line.data() + reach;
        if (source.reflected) {
            const float *about = &heights_[source.about * columns_];
            for (std::size_t x = 0; x < columns_; ++x) {
                to[x] = Real(2) * Real(about[x]) - Real(from[x]);
            }
        } else {
            std::copy(from, from + columns_, to);
        }
        for (std::size_t k = 1; k <= reach; ++k) {
            const auto left = -static_cast<std::ptrdiff_t>(k);
            const auto right = static_cast<std::ptrdiff_t>(columns_ + k - 1);
            for (const std::ptrdiff_t x : {left, right}) {
                const Tap column = tap(x, columns_, settings_.wrap_x);
                to[x] = column.reflected ? Real(2) * to[column.about] - to[column.at] : to[column.at];
            }
        }
    }

    std::span<const float> heights_;
    std::size_t rows_;
    std::size_t columns_;
    const NormalSettings &settings_;
    std::array<std::vector<Real>, 5> lines_;
    std::array<std::ptrdiff_t, 5> held_{};
};

template <typename Real>
void store(Real dx, Real dy, float *out) {
    if constexpr (sizeof(Real) ==
                  sizeof(double)) { // far too steep for float: the larger slope becomes 1 first
        const Real largest = std::max({std::abs(dx), std::abs(dy), Real(1)});
        const Real x = dx / largest;
        const Real y = dy / largest;
        const Real z = Real(1) / largest;
        const Real inverse = Real(1) / std::sqrt(x * x + y * y + z * z);
        out[0] = static_cast<float>(Real(0) - x * inverse);
        out[1] = static_cast<float>(y * inverse);
        out[2] = static_cast<float>(z * inverse);
    } else {
        const Real inverse = Real(1) / std::sqrt(dx * dx + dy * dy + Real(1));
        out[0] = Real(0) - dx * inverse;
        out[1] = dy * inverse;
        out[2] = inverse;
    }
}

// One row of slopes -> one row of normals. The loops are written for the vectoriser: no branch, no alias.
template <typename Real>
PARADIZE_CLONES void finish_row(const Real *__restrict dx, const Real *__restrict dy, std::size_t columns,
                                float *__restrict out) {
    for (std::size_t x = 0; x < columns; ++x) {
        store(dx[x], dy[x], out + 3 * x);
    }
}

template <typename Real>
PARADIZE_CLONES void central_row(const Real *__restrict above, const Real *__restrict here,
                                 const Real *__restrict below, std::size_t columns, Real sx, Real sy,
                                 Real *__restrict dx, Real *__restrict dy) {
    for (std::size_t x = 0; x < columns; ++x) {
        dx[x] = (here[x + 1] - *(here + x - 1)) * sx;
        dy[x] = (below[x] - above[x]) * sy;
    }
}

template <typename Real>
PARADIZE_CLONES void scharr_row(const Real *__restrict above, const Real *__restrict here,
                                const Real *__restrict below, std::size_t columns, Real sx, Real sy,
                                Real *__restrict dx, Real *__restrict dy) {
    for (std::size_t x = 0; x < columns; ++x) {
        const Real *a = above + x;
        const Real *h = here + x;
        const Real *b = below + x;
        dx[x] = (Real(3) * ((a[1] - *(a - 1)) + (b[1] - *(b - 1))) + Real(10) * (h[1] - *(h - 1))) * sx;
        dy[x] = (Real(3) * ((*(b - 1) - *(a - 1)) + (b[1] - a[1])) + Real(10) * (b[0] - a[0])) * sy;
    }
}

template <typename Real>
PARADIZE_CLONES void fourth_row(const Real *__restrict above2, const Real *__restrict above,
                                const Real *__restrict here, const Real *__restrict below,
                                const Real *__restrict below2, std::size_t columns, Real sx, Real sy,
                                Real *__restrict dx, Real *__restrict dy) {
    for (std::size_t x = 0; x < columns; ++x) {
        const Real *h = here + x;
        dx[x] = (Real(8) * (h[1] - *(h - 1)) - (h[2] - *(h - 2))) * sx;
        dy[x] = (Real(8) * (below[x] - above[x]) - (below2[x] - above2[x])) * sy;
    }
}

template <typename Real>
void filter_rows(std::span<const float> heights, std::size_t rows, std::size_t columns,
                 const NormalSettings &settings, std::span<float> normals, std::size_t first,
                 std::size_t last) {
    Window<Real> window(heights, rows, columns, settings);
    std::vector<Real> dx(columns);
    std::vector<Real> dy(columns);
    const double divisor =
        settings.filter == Filter::central ? 2.0 : (settings.filter == Filter::scharr ? 32.0 : 12.0);
    const auto sx = static_cast<Real>(settings.scale_x / divisor);
    const auto sy = static_cast<Real>((settings.green_down ? -1.0 : 1.0) * settings.scale_y / divisor);
    for (std::size_t row = first; row < last; ++row) {
        const auto y = static_cast<std::ptrdiff_t>(row);
        const Real *above = window.row(y - 1);
        const Real *here = window.row(y);
        const Real *below = window.row(y + 1);
        switch (settings.filter) {
        case Filter::central:
            central_row(above, here, below, columns, sx, sy, dx.data(), dy.data());
            break;
        case Filter::scharr:
            scharr_row(above, here, below, columns, sx, sy, dx.data(), dy.data());
            break;
        case Filter::fourth:
            fourth_row(window.row(y - 2), above, here, below, window.row(y + 2), columns, sx, sy, dx.data(),
                       dy.data());
            break;
        }
        finish_row(dx.data(), dy.data(), columns, &normals[row * columns * 3]);
    }
}

// Slopes inside islands only: the texels near a border once more, with the taps that stay inside.
class IslandSlopes {
  public:
    IslandSlopes(std::span<const float> heights, std::size_t rows, std::size_t columns,
                 std::span<const std::int32_t> islands, const NormalSettings &settings)
        : heights_(heights), rows_(rows), columns_(columns), islands_(islands), settings_(settings) {}

    // Whether every texel that a filter at (x, y) may touch is of its island.
    bool inside(std::size_t x, std::size_t y) const {
        const std::int32_t id = islands_[y * columns_ + x];
        for (std::ptrdiff_t j = -2; j <= 2; ++j) {
            const Tap row = tap(static_cast<std::ptrdiff_t>(y) + j, rows_, settings_.wrap_y);
            for (std::ptrdiff_t i = -2; i <= 2; ++i) {
                const Tap column = tap(static_cast<std::ptrdiff_t>(x) + i, columns_, settings_.wrap_x);
                if (islands_[row.at * columns_ + column.at] != id) {
                    return false;
                }
            }
        }
        return true;
    }

    // Central, one-sided or no difference, as the island allows. In units of height.
    double along_x(std::size_t x, std::size_t y) const {
        return slope(x, y, neighbour_x(x, -1), y, neighbour_x(x, 1), y);
    }
    double along_y(std::size_t x, std::size_t y) const {
        return slope(x, y, x, neighbour_y(y, -1), x, neighbour_y(y, 1));
    }

  private:
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

    std::size_t neighbour_x(std::size_t x, std::ptrdiff_t step) const {
        const Tap t = tap(static_cast<std::ptrdiff_t>(x) + step, columns_, settings_.wrap_x);
        return t.reflected ? none : t.at;
    }
    std::size_t neighbour_y(std::size_t y, std::ptrdiff_t step) const {
        const Tap t = tap(static_cast<std::ptrdiff_t>(y) + step, rows_, settings_.wrap_y);
        return t.reflected ? none : t.at;
    }

    double slope(std::size_t x, std::size_t y, std::size_t x0, std::size_t y0, std::size_t x1,
                 std::size_t y1) const {
        const std::size_t centre = y * columns_ + x;
        const bool before = x0 != none && y0 != none && islands_[y0 * columns_ + x0] == islands_[centre];
        const bool after = x1 != none && y1 != none && islands_[y1 * columns_ + x1] == islands_[centre];
        const double h = heights_[centre];
        const double low = before ? heights_[y0 * columns_ + x0] : h;
        const double high = after ? heights_[y1 * columns_ + x1] : h;
        return before && after ? (high - low) * 0.5 : high - low;
    }

    std::span<const float> heights_;
    std::size_t rows_;
    std::size_t columns_;
    std::span<const std::int32_t> islands_;
    const NormalSettings &settings_;
};

struct Range {
    float low;
    float high;
};

// The lowest and the highest of count > 0 finite values, sixteen side by side.
PARADIZE_CLONES Range range_of(const float *values, std::size_t count) {
    constexpr std::size_t lanes = 16;
    std::array<float, lanes> low;
    std::array<float, lanes> high;
    low.fill(values[0]);
    high.fill(values[0]);
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        for (std::size_t k = 0; k < lanes; ++k) {
            const float v = values[i + k];
            low[k] = v < low[k] ? v : low[k];
            high[k] = v > high[k] ? v : high[k];
        }
    }
    for (; i < count; ++i) {
        low[0] = std::min(low[0], values[i]);
        high[0] = std::max(high[0], values[i]);
    }
    return {*std::min_element(low.begin(), low.end()), *std::max_element(high.begin(), high.end())};
}

} // namespace

void normals_from_heights(std::span<const float> heights, std::size_t rows, std::size_t columns,
                          std::span<const std::int32_t> islands, const NormalSettings &settings,
                          std::span<float> normals, int threads) {
    if (rows == 0 || columns == 0) {
        return;
    }
    const Range ends = range_of(heights.data(), heights.size());
    const double range = static_cast<double>(ends.high) - static_cast<double>(ends.low);
    const double scale = std::max(std::abs(settings.scale_x), std::abs(settings.scale_y));
    const double largest =
        std::max(std::abs(static_cast<double>(ends.high)), std::abs(static_cast<double>(ends.low)));
    const bool steep =
        range * scale > 1e15 || largest > 1e36 || scale > 1e36 || (scale > 0.0 && scale < 1e-30);
    for_rows(rows, threads, [&](std::size_t first, std::size_t last) {
        if (steep) {
            filter_rows<double>(heights, rows, columns, settings, normals, first, last);
        } else {
            filter_rows<float>(heights, rows, columns, settings, normals, first, last);
        }
        if (islands.empty()) {
            return;
        }
        const IslandSlopes slopes(heights, rows, columns, islands, settings);
        const double sy = settings.green_down ? -settings.scale_y : settings.scale_y;
        for (std::size_t y = first; y < last; ++y) {
            for (std::size_t x = 0; x < columns; ++x) {
                if (!slopes.inside(x, y)) {
                    const double dx = slopes.along_x(x, y) * settings.scale_x;
                    store<double>(dx, slopes.along_y(x, y) * sy, &normals[(y * columns + x) * 3]);
                }
            }
        }
    });
}

} // namespace paradize::maps
