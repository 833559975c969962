#include "reference_maps_ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu.hpp"

namespace paradize::reference {
namespace {

constexpr auto unheld = std::numeric_limits<std::ptrdiff_t>::min();

// Where a value beyond an edge comes from: texel `at`, or 2 h[about] - h[at] where it is reflected.
struct Place {
    std::size_t at;
    std::size_t about;
    bool reflected;
};

Place place(std::ptrdiff_t i, std::size_t size, bool wrap) {
    const auto n = static_cast<std::ptrdiff_t>(size);
    if (wrap) {
        const std::ptrdiff_t rest = i % n;
        return {static_cast<std::size_t>(rest < 0 ? rest + n : rest), 0, false};
    }
    if (i >= 0 && i < n) {
        return {static_cast<std::size_t>(i), 0, false};
    }
    const std::ptrdiff_t edge = i < 0 ? 0 : n - 1;
    const std::ptrdiff_t mirrored = std::clamp<std::ptrdiff_t>(2 * edge - i, 0, n - 1);
    return {static_cast<std::size_t>(mirrored), static_cast<std::size_t>(edge), true};
}

PARADIZE_CLONES void widen(const float *__restrict from, std::size_t count, double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] = from[i];
    }
}

// to += weight * (a - b)
PARADIZE_CLONES void add_difference(const double *a, const double *b, std::size_t count, double weight,
                                    double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] += weight * (a[i] - b[i]);
    }
}

// to += weight * (a + b)
PARADIZE_CLONES void add_sum(const double *a, const double *b, std::size_t count, double weight,
                             double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] += weight * (a[i] + b[i]);
    }
}

PARADIZE_CLONES void scaled(const double *__restrict from, std::size_t count, double weight,
                            double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] = weight * from[i];
    }
}

PARADIZE_CLONES void unit(const double *__restrict dx, const double *__restrict dy, std::size_t count,
                          double scale_x, double scale_y, double *__restrict x, double *__restrict y,
                          double *__restrict z) {
    for (std::size_t i = 0; i < count; ++i) {
        const double u = dx[i] * scale_x;
        const double v = dy[i] * scale_y;
        const double au = std::abs(u);
        const double av = std::abs(v);
        const double steeper = au > av ? au : av;
        const double largest = steeper > 1.0 ? steeper : 1.0; // squares of what is left do not overflow
        const double a = u / largest;
        const double b = v / largest;
        const double c = 1.0 / largest;
        const double length = std::sqrt(a * a + b * b + c * c);
        x[i] = 0.0 - a / length;
        y[i] = b / length;
        z[i] = c / length;
    }
}

} // namespace

GroundRows::GroundRows(const Ground &ground, int threads)
    : ground_(ground), reach_(std::max(ground.derivative.size(), ground.smooth.size() - 1)),
      lines_(2 * reach_ + 1, std::vector<double>(ground.size.columns + 2 * reach_)),
      held_(lines_.size(), unheld), work_(ground.size.columns + 2 * reach_), dx_(ground.size.columns),
      dy_(ground.size.columns) {
    if (ground.spectral) {
        slopes_ = std::make_shared<const Slopes>(
            spectral_slopes(ground.heights, ground.size.rows, ground.size.columns, threads));
    }
}

std::unique_ptr<Rows> GroundRows::fresh() const {
    return std::make_unique<GroundRows>(*this);
}

// Row y, possibly outside, in float64; index 0 is column -reach.
const double *GroundRows::padded(std::ptrdiff_t y) {
    const auto count = static_cast<std::ptrdiff_t>(lines_.size());
    const auto slot = static_cast<std::size_t>((y % count + count) % count);
    std::vector<double> &line = lines_[slot];
    if (held_[slot] == y) {
        return line.data();
    }
    held_[slot] = y;
    const std::size_t columns = ground_.size.columns;
    double *middle = line.data() + reach_;
    const Place from = place(y, ground_.size.rows, ground_.wrap_y);
    widen(&ground_.heights[from.at * columns], columns, middle);
    if (from.reflected) {
        const float *about = &ground_.heights[from.about * columns];
        for (std::size_t x = 0; x < columns; ++x) {
            middle[x] = 2.0 * about[x] - middle[x];
        }
    }
    for (std::size_t k = 1; k <= reach_; ++k) {
        const auto left = -static_cast<std::ptrdiff_t>(k);
        const auto right = static_cast<std::ptrdiff_t>(columns + k - 1);
        for (const std::ptrdiff_t x : {left, right}) {
            const Place p = place(x, columns, ground_.wrap_x);
            line[static_cast<std::size_t>(x + static_cast<std::ptrdiff_t>(reach_))] =
                p.reflected ? 2.0 * middle[p.about] - middle[p.at] : middle[p.at];
        }
    }
    return line.data();
}

// dx_ and dy_ of row y by taps.
void GroundRows::filtered(std::ptrdiff_t y) {
    const std::size_t columns = ground_.size.columns;
    const std::size_t wide = work_.size();
    const std::vector<double> &smooth = ground_.smooth;
    scaled(padded(y), wide, smooth[0], work_.data());
    for (std::size_t j = 1; j < smooth.size(); ++j) {
        const auto step = static_cast<std::ptrdiff_t>(j);
        add_sum(padded(y + step), padded(y - step), wide, smooth[j], work_.data());
    }
    std::fill(dx_.begin(), dx_.end(), 0.0);
    for (std::size_t k = 1; k <= ground_.derivative.size(); ++k) {
        const double *middle = work_.data() + reach_;
        add_difference(middle + k, middle - k, columns, ground_.derivative[k - 1], dx_.data());
    }
    std::fill(work_.begin(), work_.end(), 0.0);
    for (std::size_t k = 1; k <= ground_.derivative.size(); ++k) {
        const auto step = static_cast<std::ptrdiff_t>(k);
        add_difference(padded(y + step), padded(y - step), wide, ground_.derivative[k - 1], work_.data());
    }
    const double *middle = work_.data() + reach_;
    scaled(middle, columns, smooth[0], dy_.data());
    for (std::size_t j = 1; j < smooth.size(); ++j) {
        add_sum(middle + j, middle - j, columns, smooth[j], dy_.data());
    }
}

void GroundRows::row(std::size_t y, double *out) {
    const std::size_t columns = ground_.size.columns;
    if (ground_.spectral) {
        widen(&slopes_->x[y * columns], columns, dx_.data());
        widen(&slopes_->y[y * columns], columns, dy_.data());
    } else {
        filtered(static_cast<std::ptrdiff_t>(y));
    }
    unit(dx_.data(), dy_.data(), columns, ground_.scale_x,
         ground_.green_down ? -ground_.scale_y : ground_.scale_y, out, out + columns, out + 2 * columns);
    if (!ground_.islands.empty()) {
        inside(y, out + 3 * columns);
    }
}

void GroundRows::inside(std::size_t y, double *out) const {
    const std::size_t columns = ground_.size.columns;
    const auto reach = static_cast<std::ptrdiff_t>(reach_);
    const std::int32_t *here = &ground_.islands[y * columns];
    for (std::size_t x = 0; x < columns; ++x) {
        out[x] = here[x] >= 0 ? 1.0 : 0.0;
    }
    for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
        const Place row = place(static_cast<std::ptrdiff_t>(y) + j, ground_.size.rows, ground_.wrap_y);
        const std::int32_t *there = &ground_.islands[row.at * columns];
        // How far back the ids of the other row were last unlike: one walk along it, not one per texel.
        std::ptrdiff_t same = 0; // columns up to this one that hold one id
        std::int32_t id = there[place(-reach, columns, ground_.wrap_x).at];
        const auto end = static_cast<std::ptrdiff_t>(columns) + reach;
        for (std::ptrdiff_t x = -reach; x < end; ++x) {
            const std::int32_t next = there[place(x, columns, ground_.wrap_x).at];
            same = next == id ? same + 1 : 1;
            id = next;
            const std::ptrdiff_t centre = x - reach;
            if (centre >= 0 && (same < 2 * reach + 1 || id != here[centre])) {
                out[centre] = 0.0;
            }
        }
    }
}

} // namespace paradize::reference
