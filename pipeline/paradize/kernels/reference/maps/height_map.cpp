#include "reference/maps/height_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/maps/angle.hpp"
#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

constexpr auto unheld = std::numeric_limits<std::ptrdiff_t>::min();

// Where a value beyond an edge comes from: texel `at`, or 2 h[about] - h[at] where it is reflected.
struct SourceTexel {
    std::size_t at;
    std::size_t about;
    bool reflected;
};

SourceTexel place(std::ptrdiff_t i, std::size_t size, bool wrap) {
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

PARADIZE_CLONES void unit_normals(const double *__restrict dx, const double *__restrict dy, std::size_t count,
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

// Slopes and how far they may be off, along one axis; and what turns them into metres per metre.
struct Axis {
    const double *slope;
    const double *open;
    double scale;
};

// Of the four slopes that lie farthest along both axes, those whose normal is farthest from unit normals.
PARADIZE_CLONES void farthest(const Axis &along, const Axis &down, const double *__restrict nx,
                              const double *__restrict ny, const double *__restrict nz, std::size_t count,
                              double *__restrict best_u, double *__restrict best_v) {
    const double *__restrict slope_u = along.slope;
    const double *__restrict slope_v = down.slope;
    const double *__restrict open_u = along.open;
    const double *__restrict open_v = down.open;
    const double scale_u = along.scale;
    const double scale_v = down.scale;
    for (std::size_t i = 0; i < count; ++i) {
        double least = 2.0;
        double found_u = 0.0;
        double found_v = 0.0;
        for (int corner = 0; corner < 4; ++corner) {
            const double steep_u = corner < 2 ? slope_u[i] - open_u[i] : slope_u[i] + open_u[i];
            const double steep_v = corner % 2 == 0 ? slope_v[i] - open_v[i] : slope_v[i] + open_v[i];
            const double u = steep_u * scale_u;
            const double v = steep_v * scale_v;
            const double au = std::abs(u);
            const double av = std::abs(v);
            const double steeper = au > av ? au : av;
            const double largest = steeper > 1.0 ? steeper : 1.0;
            const double a = 0.0 - u / largest;
            const double b = v / largest;
            const double c = 1.0 / largest;
            const double cosine = (a * nx[i] + b * ny[i] + c * nz[i]) / std::sqrt(a * a + b * b + c * c);
            const bool less = cosine < least;
            least = less ? cosine : least;
            found_u = less ? steep_u : found_u;
            found_v = less ? steep_v : found_v;
        }
        best_u[i] = found_u;
        best_v[i] = found_v;
    }
}

} // namespace

// Half of the widest gap between rising codes beside a height: before and after its code, or, of a height
// between two codes, between them and after them (a colour's steps are at most those of a grey as bright, and
// steps grow with brightness). The range is cut into even bins, each of which knows its first code: a search
// looks at few.
class HalfSteps {
  public:
    explicit HalfSteps(std::span<const float> codes)
        : codes_(codes), halves_(codes.size() + 1),
          first_(std::min(16 * codes.size(), std::max(codes.size(), most_bins)) + 1) {
        const auto gap = [&](std::size_t k) {
            return k > 0 && k < codes.size() ? static_cast<double>(codes[k]) - codes[k - 1] : 0.0;
        };
        for (std::size_t k = 0; k <= codes.size(); ++k) {
            halves_[k] = 0.5 * std::max({0.0, gap(k), gap(k + 1)});
        }
        for (std::size_t k = codes.size(); k-- > 0;) {
            first_[bin(codes[k])] = static_cast<std::uint32_t>(k);
        }
        for (std::size_t b = 1; b < first_.size(); ++b) {
            first_[b] = std::max(first_[b - 1], first_[b]);
        }
    }
    double of(float height) const {
        std::size_t at = first_[bin(height)];
        while (at > 0 && codes_[at - 1] >= height) {
            --at;
        }
        while (at < codes_.size() && codes_[at] < height) {
            ++at;
        }
        return halves_[at];
    }

  private:
    static constexpr std::size_t most_bins = std::size_t{1} << 16U;

    std::size_t bin(float height) const {
        const double low = codes_.front();
        const double span = codes_.back() - low;
        const double share = span > 0.0 ? std::clamp((height - low) / span, 0.0, 1.0) : 0.0;
        return static_cast<std::size_t>(share * static_cast<double>(first_.size() - 1));
    }

    std::span<const float> codes_;
    std::vector<double> halves_; // by the first code that is not below the height
    std::vector<std::uint32_t> first_;
};

NormalRows::NormalRows(const HeightMap &height_map)
    : height_map_(height_map),
      reach_(std::max(height_map.taps.reach(), height_map.codes.empty() ? 0 : height_map.exact.reach())) {
    const std::size_t columns = height_map.size.columns;
    const std::size_t wide = columns + 2 * reach_;
    for (Window *window : {&heights_, &halves_}) {
        window->lines.assign(2 * reach_ + 1, std::vector<double>(wide));
        window->held.assign(2 * reach_ + 1, unheld);
    }
    work_.resize(wide);
    for (Steepness *steepness : {&slope_, &exact_, &open_, &corner_}) {
        steepness->x.resize(columns);
        steepness->y.resize(columns);
    }
    corner_z_.resize(columns);
    if (!height_map.codes.empty()) {
        half_steps_ = std::make_shared<const HalfSteps>(height_map.codes);
    }
}

std::unique_ptr<Rows> NormalRows::fresh() const {
    return std::make_unique<NormalRows>(*this);
}

// The line of a window that row y, possibly outside, takes; fresh: whether it holds another row yet.
std::vector<double> *NormalRows::line(Window &window, std::ptrdiff_t y, bool &fresh) const {
    const auto count = static_cast<std::ptrdiff_t>(window.lines.size());
    const auto slot = static_cast<std::size_t>((y % count + count) % count);
    fresh = window.held[slot] != y;
    window.held[slot] = y;
    return &window.lines[slot];
}

// Fills what is beyond both ends of a line from its middle; of a reflection the mirrored part counts by
// `sign`.
void NormalRows::pad(std::vector<double> &line, double sign) const {
    const std::size_t columns = height_map_.size.columns;
    double *middle = line.data() + reach_;
    for (std::size_t k = 1; k <= reach_; ++k) {
        const auto left = -static_cast<std::ptrdiff_t>(k);
        const auto right = static_cast<std::ptrdiff_t>(columns + k - 1);
        for (const std::ptrdiff_t x : {left, right}) {
            const SourceTexel p = place(x, columns, height_map_.wrap_x);
            line[static_cast<std::size_t>(x + static_cast<std::ptrdiff_t>(reach_))] =
                p.reflected ? 2.0 * middle[p.about] + sign * middle[p.at] : middle[p.at];
        }
    }
}

// Row y, possibly outside, in float64; index 0 is column -reach.
const double *NormalRows::padded(std::ptrdiff_t y) {
    bool fresh = false;
    std::vector<double> &line = *this->line(heights_, y, fresh);
    if (!fresh) {
        return line.data();
    }
    const std::size_t columns = height_map_.size.columns;
    double *middle = line.data() + reach_;
    const SourceTexel from = place(y, height_map_.size.rows, height_map_.wrap_y);
    widen(&height_map_.heights[from.at * columns], columns, middle);
    if (from.reflected) {
        const float *about = &height_map_.heights[from.about * columns];
        for (std::size_t x = 0; x < columns; ++x) {
            middle[x] = 2.0 * about[x] - middle[x];
        }
    }
    pad(line, -1.0);
    return line.data();
}

// How far each height of row y may be off: half of the widest gap between codes beside it. Beyond an edge the
// parts of a reflection add up.
const double *NormalRows::half_steps(std::ptrdiff_t y) {
    bool fresh = false;
    std::vector<double> &line = *this->line(halves_, y, fresh);
    if (!fresh) {
        return line.data();
    }
    const std::size_t columns = height_map_.size.columns;
    double *middle = line.data() + reach_;
    const SourceTexel from = place(y, height_map_.size.rows, height_map_.wrap_y);
    for (std::size_t x = 0; x < columns; ++x) {
        middle[x] = half_steps_->of(height_map_.heights[from.at * columns + x]);
        if (from.reflected) {
            middle[x] += 2.0 * half_steps_->of(height_map_.heights[from.about * columns + x]);
        }
    }
    pad(line, 1.0);
    return line.data();
}

// Slopes of row y by taps.
void NormalRows::filtered(std::ptrdiff_t y, const Taps &taps, Steepness &out) {
    const std::size_t columns = height_map_.size.columns;
    const std::size_t wide = work_.size();
    const std::vector<double> &smooth = taps.smooth;
    scaled(padded(y), wide, smooth[0], work_.data());
    for (std::size_t j = 1; j < smooth.size(); ++j) {
        const auto step = static_cast<std::ptrdiff_t>(j);
        add_sum(padded(y + step), padded(y - step), wide, smooth[j], work_.data());
    }
    std::fill(out.x.begin(), out.x.end(), 0.0);
    for (std::size_t k = 1; k <= taps.derivative.size(); ++k) {
        const double *middle = work_.data() + reach_;
        add_difference(middle + k, middle - k, columns, taps.derivative[k - 1], out.x.data());
    }
    std::fill(work_.begin(), work_.end(), 0.0);
    for (std::size_t k = 1; k <= taps.derivative.size(); ++k) {
        const auto step = static_cast<std::ptrdiff_t>(k);
        add_difference(padded(y + step), padded(y - step), wide, taps.derivative[k - 1], work_.data());
    }
    const double *middle = work_.data() + reach_;
    scaled(middle, columns, smooth[0], out.y.data());
    for (std::size_t j = 1; j < smooth.size(); ++j) {
        add_sum(middle + j, middle - j, columns, smooth[j], out.y.data());
    }
}

// How far the exact taps' slopes of row y may be off: every tap by its weight times its height's half step.
void NormalRows::reached(std::ptrdiff_t y) {
    const std::size_t columns = height_map_.size.columns;
    const double *here = half_steps(y) + reach_;
    std::fill(open_.x.begin(), open_.x.end(), 0.0);
    std::fill(open_.y.begin(), open_.y.end(), 0.0);
    for (std::size_t k = 1; k <= height_map_.exact.derivative.size(); ++k) {
        const double weight = std::abs(height_map_.exact.derivative[k - 1]);
        const auto step = static_cast<std::ptrdiff_t>(k);
        add_sum(here + k, here - k, columns, weight, open_.x.data());
        add_sum(half_steps(y + step) + reach_, half_steps(y - step) + reach_, columns, weight,
                open_.y.data());
    }
}

// Slopes no farther from the exact ones than the half steps let them be.
void NormalRows::hold() {
    for (std::size_t x = 0; x < height_map_.size.columns; ++x) {
        slope_.x[x] = std::clamp(slope_.x[x], exact_.x[x] - open_.x[x], exact_.x[x] + open_.x[x]);
        slope_.y[x] = std::clamp(slope_.y[x], exact_.y[x] - open_.y[x], exact_.y[x] + open_.y[x]);
    }
}

// Of the four normals whose slopes lie farthest along both axes, the angle to the farthest.
void NormalRows::cone(double *normals, double *degrees) {
    const std::size_t columns = height_map_.size.columns;
    farthest({slope_.x.data(), open_.x.data(), height_map_.scale_x},
             {slope_.y.data(), open_.y.data(), signed_scale_y()}, normals, normals + columns,
             normals + 2 * columns, columns, corner_.x.data(), corner_.y.data());
    unit_normals(corner_.x.data(), corner_.y.data(), columns, height_map_.scale_x, signed_scale_y(),
                 exact_.x.data(), exact_.y.data(), corner_z_.data());
    angles_between({normals, normals + columns, normals + 2 * columns},
                   {exact_.x.data(), exact_.y.data(), corner_z_.data()}, columns, degrees);
}

void NormalRows::drawn(std::size_t y, double *out) const {
    const std::size_t columns = height_map_.size.columns;
    const float *from = &height_map_.drawn[3 * y * columns];
    for (std::size_t i = 0; i < columns; ++i) {
        const double x = from[3 * i];
        const double y_up = from[3 * i + 1];
        const double z = from[3 * i + 2];
        double length = std::sqrt(x * x + y_up * y_up + z * z);
        if (length < 1.0 - 1e-6) { // a mean; else 1 but for the rounding of floats
            length = 1.0;
        }
        out[i] = x / length;
        out[columns + i] = y_up / length;
        out[2 * columns + i] = z / length;
    }
    if (!height_map_.islands.empty()) {
        inside(y, out + 3 * columns);
    }
}

void NormalRows::row(std::size_t y, double *out) {
    if (!height_map_.drawn.empty()) {
        drawn(y, out);
        return;
    }
    const std::size_t columns = height_map_.size.columns;
    const auto at = static_cast<std::ptrdiff_t>(y);
    filtered(at, height_map_.taps, slope_);
    const bool open = !height_map_.codes.empty() && (height_map_.held || height_map_.cones);
    if (open) {
        reached(at);
    }
    if (open && height_map_.held) {
        filtered(at, height_map_.exact, exact_);
        hold();
    }
    unit_normals(slope_.x.data(), slope_.y.data(), columns, height_map_.scale_x, signed_scale_y(), out,
                 out + columns, out + 2 * columns);
    if (!height_map_.islands.empty()) {
        inside(y, out + 3 * columns);
    }
    if (height_map_.cones && open) {
        cone(out, out + cone_plane() * columns);
    } else if (height_map_.cones) {
        std::fill_n(out + cone_plane() * columns, columns, 0.0);
    }
}

void NormalRows::inside(std::size_t y, double *out) const {
    const std::size_t columns = height_map_.size.columns;
    const auto reach = static_cast<std::ptrdiff_t>(reach_);
    const std::int32_t *here = &height_map_.islands[y * columns];
    for (std::size_t x = 0; x < columns; ++x) {
        out[x] = here[x] >= 0 ? 1.0 : 0.0;
    }
    for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
        const SourceTexel row =
            place(static_cast<std::ptrdiff_t>(y) + j, height_map_.size.rows, height_map_.wrap_y);
        const std::int32_t *there = &height_map_.islands[row.at * columns];
        // How far back the ids of the other row were last unlike: one walk along it, not one per texel.
        std::ptrdiff_t same = 0; // columns up to this one that hold one id
        std::int32_t id = there[place(-reach, columns, height_map_.wrap_x).at];
        const auto end = static_cast<std::ptrdiff_t>(columns) + reach;
        for (std::ptrdiff_t x = -reach; x < end; ++x) {
            const std::int32_t next = there[place(x, columns, height_map_.wrap_x).at];
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
