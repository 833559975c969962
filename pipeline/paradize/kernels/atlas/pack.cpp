#include "atlas/pack.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "atlas/field.hpp"

namespace paradize::atlas {

namespace {

constexpr int attempts = 6;
// With this many charts the guesses are good, and a layout takes long.
constexpr std::size_t many_charts = 200;
constexpr int attempts_with_many = 4;
// A chart is looked a place for from the lowest row on that one of so many before it has found; from the
// first row again when charts have become this much smaller. So each takes a few rows' work, not all.
constexpr std::size_t looked_back = 64;
constexpr double smaller = 0.7;

struct PlacedChart {
    std::vector<double> corners; // (k, 3, 2)
    std::array<double, 2> low{}, high{};
    double area = 0;

    double longest() const { return std::max(high[0] - low[0], high[1] - low[1]); }
};

std::array<double, 2> turned(double x, double y, const PlacedChart &chart, int turn) {
    switch (turn) {
    case 0:
        return {x - chart.low[0], y - chart.low[1]};
    case 1:
        return {chart.high[1] - y, x - chart.low[0]};
    case 2:
        return {chart.high[0] - x, chart.high[1] - y};
    default:
        return {y - chart.low[1], chart.high[0] - x};
    }
}

// Every cell that a triangle touches lies in its row's span.
Shape shape_of(const PlacedChart &chart, int turn, double scale) {
    const double wide = (turn % 2 == 0 ? chart.high[0] - chart.low[0] : chart.high[1] - chart.low[1]) * scale;
    const double tall = (turn % 2 == 0 ? chart.high[1] - chart.low[1] : chart.high[0] - chart.low[0]) * scale;
    Shape shape;
    shape.width = static_cast<std::int32_t>(wide) + 1;
    const auto height = static_cast<std::size_t>(tall) + 1;
    std::vector<double> low(height, std::numeric_limits<double>::infinity());
    std::vector<double> high(height, -std::numeric_limits<double>::infinity());
    const auto cover = [&](std::size_t row, double x) {
        low[row] = std::min(low[row], x);
        high[row] = std::max(high[row], x);
    };
    for (std::size_t t = 0; t < chart.corners.size(); t += 6) {
        std::array<std::array<double, 2>, 3> p{};
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = turned(chart.corners[t + 2 * k], chart.corners[t + 2 * k + 1], chart, turn);
            p[k][0] *= scale;
            p[k][1] *= scale;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            auto a = p[k], b = p[(k + 1) % 3];
            if (a[1] > b[1]) {
                std::swap(a, b);
            }
            const auto first = std::min(static_cast<std::size_t>(std::max(a[1], 0.0)), height - 1);
            const auto last = std::min(static_cast<std::size_t>(std::max(b[1], 0.0)), height - 1);
            cover(first, a[0]);
            cover(last, b[0]);
            for (std::size_t row = first; row < last;
                 ++row) { // where the edge leaves a row it enters the next
                const double share = (static_cast<double>(row + 1) - a[1]) / (b[1] - a[1]);
                const double x = a[0] + std::clamp(share, 0.0, 1.0) * (b[0] - a[0]);
                cover(row, x);
                cover(row + 1, x);
            }
        }
    }
    for (std::size_t row = 0; row < height; ++row) {
        if (low[row] > high[row]) { // numbers at a row's very edge
            shape.rows.push_back({0, shape.width});
            continue;
        }
        const auto first = std::clamp(static_cast<std::int32_t>(std::floor(low[row])), 0, shape.width - 1);
        const auto last =
            std::clamp(static_cast<std::int32_t>(std::floor(high[row])), first, shape.width - 1);
        shape.rows.push_back({first, last + 1});
    }
    return shape;
}

// The shape with `spacing` cells around it; its rows and columns start `spacing` earlier.
Shape widened(const Shape &shape, std::int32_t spacing) {
    const auto height = static_cast<std::int32_t>(shape.rows.size());
    Shape out;
    out.width = shape.width + 2 * spacing;
    for (std::int32_t row = -spacing; row < height + spacing; ++row) {
        Span span{std::numeric_limits<std::int32_t>::max(), 0};
        for (std::int32_t r = std::max(0, row - spacing); r <= std::min(height - 1, row + spacing); ++r) {
            span.low = std::min(span.low, shape.rows[static_cast<std::size_t>(r)].low);
            span.high = std::max(span.high, shape.rows[static_cast<std::size_t>(r)].high + 2 * spacing);
        }
        out.rows.push_back(span);
    }
    return out;
}

constexpr std::int32_t too_high = std::numeric_limits<std::int32_t>::max();

// Puts all charts into a strip `side` cells wide; how high it became, or `too_high` where they need more than
// `most`.
std::int32_t lay_out(const std::vector<PlacedChart> &charts, const std::vector<std::size_t> &order,
                     double scale, std::int32_t side, std::int32_t spacing, std::int32_t most,
                     std::vector<Placement> &places) {
    Field field(side + spacing, most + spacing);
    std::int32_t height = 0;
    // By turn: the shape that was placed last, and below which row another like it does not fit.
    std::array<Shape, 4> last;
    std::array<std::int32_t, 4> from{};
    std::array<std::int32_t, looked_back> rows{};
    std::size_t placed = 0;
    double size = 0;
    for (const std::size_t index : order) {
        if (charts[index].longest() < smaller * size || placed == 0) {
            size = charts[index].longest();
            rows.fill(0);
        }
        const std::int32_t lowest = *std::ranges::min_element(rows);
        Placement best;
        std::int32_t below = most + spacing + 2;
        Shape kept;
        std::array<Shape, 4> shapes;
        for (int turn = 0; turn < 4; ++turn) {
            const auto at = static_cast<std::size_t>(turn);
            shapes[at] = shape_of(charts[index], turn, scale);
            const Shape &shape = shapes[at];
            if (turn > 1 && shape.width == shapes[at - 2].width && shape.rows == shapes[at - 2].rows) {
                continue; // it looks the same upside down
            }
            if (shape.width != last[at].width || shape.rows != last[at].rows) {
                last[at] = shape;
                from[at] = 0;
            }
            Placement found;
            if (field.find(widened(shape, spacing), std::max(from[at], lowest), below, found)) {
                from[at] = found.y;
                best = {found.x + spacing, found.y + spacing, turn};
                kept = shape;
                below = found.y + static_cast<std::int32_t>(shape.rows.size()) + 2 * spacing;
            }
        }
        if (kept.rows.empty()) {
            return too_high;
        }
        field.take(kept, best.x, best.y);
        rows[placed++ % looked_back] = best.y - spacing;
        places[index] = best;
        height = std::max(height, best.y + static_cast<std::int32_t>(kept.rows.size()));
    }
    return height;
}

// How many cells charts take with half the spacing around each, by their scale.
struct Need {
    double area = 0;   // of a chart: grows with the square of the scale
    double around = 0; // along its outline, about 1.6 times as long as a width and a height
    double gutter = 0; // however small it is

    void add(const PlacedChart &chart, std::int32_t spacing) {
        area += chart.area;
        around += 0.8 * spacing * (chart.high[0] - chart.low[0] + chart.high[1] - chart.low[1]);
        gutter += (spacing + 1) * (spacing + 1);
    }
    double cells(double scale) const { return (area * scale + around) * scale + gutter; }
    double scale(double cells) const {
        if (!(area > 0)) {
            return std::numeric_limits<double>::infinity();
        }
        const double free = std::max(cells - gutter, 0.01 * cells);
        return (std::sqrt(around * around + 4 * area * free) - around) / (2 * area);
    }
};

// The square in cells.
struct Square {
    std::uint32_t cell; // texels
    std::int32_t spacing, margin, side;
    // The field starts at the widened shapes' border: the first `spacing` rows and columns are the margin's.
    std::int32_t inner;

    Square(std::uint32_t resolution, std::uint32_t padding)
        : cell((resolution + std::uint32_t{most_cells} - 1) / std::uint32_t{most_cells}),
          spacing(static_cast<std::int32_t>((padding + cell - 1) / cell)), margin((spacing + 1) / 2),
          side(static_cast<std::int32_t>(resolution / cell) - 2 * margin), inner(side + spacing) {}

    // However small, each takes a cell and the gap beside and above it.
    std::int32_t most_charts() const {
        return side < 1 ? 0 : inner / (spacing + 1) * (inner / (spacing + 1));
    }
};

} // namespace

std::int32_t most_charts(std::uint32_t resolution, std::uint32_t padding) {
    return Square(resolution, padding).most_charts();
}

Packed pack(std::span<const double> corners, std::span<const std::int32_t> chart, std::int32_t count,
            std::uint32_t resolution, std::uint32_t padding) {
    std::vector<PlacedChart> charts(static_cast<std::size_t>(count));
    const double infinite = std::numeric_limits<double>::infinity();
    for (PlacedChart &one : charts) {
        one.low = {infinite, infinite};
        one.high = {-infinite, -infinite};
    }
    for (std::size_t t = 0; t < chart.size(); ++t) {
        PlacedChart &one = charts[static_cast<std::size_t>(chart[t])];
        const double *p = corners.data() + 6 * t;
        one.corners.insert(one.corners.end(), p, p + 6);
        one.area += std::abs((p[2] - p[0]) * (p[5] - p[1]) - (p[4] - p[0]) * (p[3] - p[1])) / 2;
        for (std::size_t k = 0; k < 6; ++k) {
            one.low[k % 2] = std::min(one.low[k % 2], p[k]);
            one.high[k % 2] = std::max(one.high[k % 2], p[k]);
        }
    }
    std::vector<std::size_t> order(charts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return charts[i].longest(); });

    const Square square(resolution, padding);
    const auto [cell, spacing, margin, side, inner] = square;
    Packed out;
    if (count > square.most_charts()) {
        return out;
    }
    Need need;
    double longest = 0;
    for (const PlacedChart &one : charts) {
        need.add(one, spacing);
        longest = std::max(longest, one.longest());
    }
    const double most = longest > 0 ? side / longest : 1;
    double good = 0, bad = infinite;
    double scale = std::min(most, need.scale(0.75 * side * side));
    std::vector<Placement> places(charts.size()), best;
    const int enough = charts.size() > many_charts ? attempts_with_many : attempts;
    for (int attempt = 0; attempt < 6 * attempts; ++attempt) {
        const std::int32_t height = lay_out(charts, order, scale, inner, spacing, 2 * side, places) - spacing;
        if (height <= side) {
            good = scale;
            best = places;
        } else {
            bad = scale;
        }
        const double gap = std::min(bad, most) - good;
        if (!best.empty() && ((attempt + 1 >= enough && gap < 0.05 * good) || gap < 2e-3 * good)) {
            break;
        }
        const double guess = height > 2 * side ? 0.7 * scale : need.scale(need.cells(scale) * side / height);
        // Kept inside what is known.
        scale = bad < infinite ? std::clamp(guess, good + 0.1 * gap, bad - 0.1 * gap)
                               : std::clamp(guess, good + 1e-3 * gap, most);
    }
    if (best.empty()) {
        return out;
    }
    out.texels_per_unit = good * cell;
    out.corners.resize(corners.size());
    for (std::size_t t = 0; t < chart.size(); ++t) {
        const auto index = static_cast<std::size_t>(chart[t]);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto p =
                turned(corners[6 * t + 2 * k], corners[6 * t + 2 * k + 1], charts[index], best[index].turn);
            out.corners[6 * t + 2 * k] = (p[0] * good + best[index].x - spacing + margin) * cell;
            out.corners[6 * t + 2 * k + 1] = (p[1] * good + best[index].y - spacing + margin) * cell;
        }
    }
    return out;
}

} // namespace paradize::atlas
