#include "normals/sweep.hpp"

#include <algorithm>
#include <cmath>

#include "simd/cpu.hpp"

namespace paradize::normals {

#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    const Kernels *kernels();                                                                                \
    }
PARADIZE_EACH_WIDTH(PARADIZE_ROWS)
#undef PARADIZE_ROWS

const Kernels *kernels_of(Width width) {
#ifdef PARADIZE_WIDE
    if (width == Width::avx512 || (width == Width::widest && has_avx512())) {
        return has_avx512() ? avx512::kernels() : nullptr;
    }
    if (width == Width::avx2 || (width == Width::widest && has_avx2())) {
        return has_avx2() ? avx2::kernels() : nullptr;
    }
#else
    if (width == Width::avx2 || width == Width::avx512) {
        return nullptr;
    }
#endif
    return baseline::kernels();
}

bool all_finite(const float *values, std::size_t n) {
    return std::all_of(values, values + n, [](float v) { return std::isfinite(v); });
}

void steep_normals(const double *nx, const double *ny, std::size_t n, float *xyz) {
    for (std::size_t i = 0; i < n; ++i) { // the larger slope becomes 1 first
        const double largest = std::max({std::abs(nx[i]), std::abs(ny[i]), 1.0});
        const double x = nx[i] / largest;
        const double y = ny[i] / largest;
        const double z = 1.0 / largest;
        const double inverse = 1.0 / std::sqrt(x * x + y * y + z * z);
        xyz[3 * i] = static_cast<float>(x * inverse + 0.0);
        xyz[3 * i + 1] = static_cast<float>(y * inverse + 0.0);
        xyz[3 * i + 2] = static_cast<float>(z * inverse);
    }
}

// The same taps in double, for rows that float cannot hold.
class Sweep::Steep {
  public:
    Steep(Source &source, std::size_t rows, std::size_t columns, const Settings &settings)
        : columns_(columns), settings_(settings),
          lines_(source, rows, columns, std::max(settings.reach, settings.across), settings.wrap_x,
                 settings.wrap_y),
          nx_(columns), ny_(columns) {}

    void row(std::size_t y, float *xyz) {
        const auto place = static_cast<std::ptrdiff_t>(y);
        std::fill(nx_.begin(), nx_.end(), 0.0);
        std::fill(ny_.begin(), ny_.end(), 0.0);
        for (std::ptrdiff_t j = -settings_.across; j <= settings_.across; ++j) {
            const double share = settings_.smooth[j < 0 ? -j : j];
            const double *line = lines_.line(place + j);
            for (std::ptrdiff_t k = 1; k <= settings_.reach; ++k) {
                const double weight = settings_.derivative[k - 1] * settings_.scale_x * share;
                add(line, -k, k, weight, nx_);
            }
        }
        const double sign = settings_.green_down ? -1.0 : 1.0;
        for (std::ptrdiff_t k = 1; k <= settings_.reach; ++k) {
            const double *above = lines_.line(place - k);
            const double *below = lines_.line(place + k);
            for (std::ptrdiff_t j = -settings_.across; j <= settings_.across; ++j) {
                const double share = settings_.smooth[j < 0 ? -j : j];
                const double weight = sign * settings_.derivative[k - 1] * settings_.scale_y * share;
                for (std::size_t x = 0; x < columns_; ++x) {
                    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) + j;
                    ny_[x] += weight * (below[at] - above[at]);
                }
            }
        }
        steep_normals(nx_.data(), ny_.data(), columns_, xyz);
    }

  private:
    void add(const double *line, std::ptrdiff_t plus, std::ptrdiff_t minus, double weight,
             std::vector<double> &to) const {
        for (std::size_t x = 0; x < columns_; ++x) {
            const auto at = static_cast<std::ptrdiff_t>(x);
            to[x] += weight * (line[at + plus] - line[at + minus]);
        }
    }

    std::size_t columns_;
    const Settings &settings_;
    Lines<double> lines_;
    std::vector<double> nx_;
    std::vector<double> ny_;
};

bool fits_float(double weight) {
    const double size = std::abs(weight);
    return size == 0.0 || (size >= 1e-30 && size <= 1e30);
}

Sweep::Sweep(Source &source, std::size_t rows, std::size_t columns, const Settings &settings,
             const Kernels &kernels)
    : rows_(rows), columns_(columns), settings_(settings), kernels_(kernels),
      depth_(std::max(settings.reach, settings.across)), general_(settings.reach > 4 || settings.across > 1),
      all_steep_(false), source_(source),
      lines_(source, rows, columns, depth_, settings.wrap_x, settings.wrap_y),
      at_(2 * static_cast<std::size_t>(depth_) + 1), along_at_(at_.size()) {
    for (int k = 0; k < settings.reach; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const double left = settings.derivative[k] * settings.scale_x;
        const double down = settings.derivative[k] * settings.scale_y * (settings.green_down ? -1.0 : 1.0);
        all_steep_ = all_steep_ || !fits_float(left) || !fits_float(down);
        left_[i] = static_cast<float>(all_steep_ ? 0.0 : left);
        down_[i] = static_cast<float>(all_steep_ ? 0.0 : down);
    }
    for (int j = 0; j <= settings.across; ++j) {
        smooth_[static_cast<std::size_t>(j)] = static_cast<float>(settings.smooth[j]);
    }
    if (general_) {
        along_.resize(lines_.count() * lines_.stride());
        scratch_.resize(lines_.stride());
    }
}

Sweep::~Sweep() = default;

void Sweep::prepare(std::ptrdiff_t y) {
    for (std::ptrdiff_t j = -depth_; j <= depth_; ++j) {
        bool fresh = false;
        const float *line = lines_.line(y + j, fresh);
        const auto i = static_cast<std::size_t>(j + depth_);
        at_[i] = line;
        if (general_) {
            float *along = along_.data() + lines_.slot(y + j) * lines_.stride();
            if (fresh) {
                kernels_.along(line, columns_, left_.data(), settings_.reach, along);
            }
            along_at_[i] = along;
        }
    }
}

void Sweep::steep_row(std::size_t y, float *xyz) {
    if (!steep_) {
        steep_ = std::make_unique<Steep>(source_, rows_, columns_, settings_);
    }
    steep_->row(y, xyz);
}

void Sweep::row(std::size_t y, float *xyz) {
    prepare(static_cast<std::ptrdiff_t>(y));
    if (!all_steep_) {
        const RowJob job{at_.data() + depth_,
                         along_at_.data() + depth_,
                         scratch_.data() + (general_ ? lines_.before() : 0),
                         columns_,
                         left_.data(),
                         down_.data(),
                         smooth_.data(),
                         settings_.reach,
                         settings_.across};
        if (kernels_.row(job, xyz)) {
            return;
        }
    }
    steep_row(y, xyz);
}

} // namespace paradize::normals
