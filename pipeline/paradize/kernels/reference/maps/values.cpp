#include <algorithm>
#include <cmath>

#include "reference/maps/angle.hpp"
#include "reference/maps/comparers.hpp"
#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

// Floats (rows, columns, channels) as planes of doubles.
class ValueRows final : public Rows {
  public:
    ValueRows(std::span<const float> values, std::size_t columns, std::size_t channels)
        : values_(values), columns_(columns), channels_(channels) {}
    std::size_t channels() const override { return channels_; }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<ValueRows>(*this); }
    void row(std::size_t y, double *out) override {
        const float *from = &values_[y * columns_ * channels_];
        for (std::size_t c = 0; c < channels_; ++c) {
            for (std::size_t x = 0; x < columns_; ++x) {
                out[c * columns_ + x] = from[x * channels_ + c];
            }
        }
    }

  private:
    std::span<const float> values_;
    std::size_t columns_;
    std::size_t channels_;
};

class ValueComparer final : public MapComparer {
  public:
    ValueComparer(const TextureView &texture, std::size_t channels, RowSums &sums)
        : MapComparer(texture, channels, sums), channels_(channels), found_(channels * texture.size.columns),
          errors_(found_.size()), squares_(found_.size()) {}

    void row(std::size_t level, std::size_t y, const double *truth) override {
        const std::size_t count = columns(level);
        for (std::size_t c = 0; c < channels_; ++c) {
            decoded(level, y, c, &found_[c * count]);
        }
        const std::size_t all = channels_ * count;
        const double sum = differences(truth, found_.data(), all, errors_.data(), squares_.data());
        take(level, y, {errors_.data(), all}, sum);
    }

  private:
    std::size_t channels_;
    std::vector<double> found_;
    std::vector<double> errors_;
    std::vector<double> squares_;
};

PARADIZE_CLONES void to_variance(const double *__restrict smoothness, std::size_t count,
                                 double *__restrict variance) {
    for (std::size_t i = 0; i < count; ++i) {
        const double rough = 1.0 - smoothness[i];
        const double alpha = rough * rough;
        variance[i] = alpha * alpha;
    }
}

// widen: whether the normals' loss of length counts (not at level 0, where it is rounding alone).
PARADIZE_CLONES void to_smoothness(const double *__restrict variance, const double *__restrict length,
                                   double widen, std::size_t count, double *__restrict smoothness) {
    for (std::size_t i = 0; i < count; ++i) {
        const double r = length[i];
        const double square = r * r;
        const double short_of = 1.0 - square > 0.0 ? 1.0 - square : 0.0;
        const double lost = widen * (2.0 * short_of / ((r > 1e-6 ? r : 1e-6) * (3.0 - square)));
        const double total = variance[i] + lost;
        smoothness[i] = 1.0 - std::sqrt(std::sqrt(total < 1.0 ? total : 1.0));
    }
}

constexpr double radians_of_degree = 0x1.1df46a2529d39p-6;

// The smoothness that a level should hold, from planes of squared roughness and the height map's normals.
// Where the height map has cones, the mean normal may be longer or shorter by their mean: a range of
// smoothness.
class Smoothness {
  public:
    Smoothness(const HeightMap &height_map, std::size_t columns)
        : cones_(height_map.cones), cone_plane_(height_map.islands.empty() ? 3 : 4), shortest_(columns),
          longest_(columns), low_(columns), high_(columns) {}

    // Per texel the smoothness nearest to `found` that is right. planes: of squared roughness and what
    // follows.
    void nearest(const double *planes, std::size_t level, std::size_t count, const double *found,
                 double *nearest) {
        const double *x = planes + count;
        const double *y = x + count;
        const double *z = y + count;
        const double *cone = x + cone_plane_ * count;
        for (std::size_t i = 0; i < count; ++i) {
            const double length = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
            const double open = cones_ ? cone[i] * radians_of_degree : 0.0;
            shortest_[i] = std::max(0.0, length - open);
            longest_[i] = std::max(length, std::min(1.0, length + open));
        }
        const double widen = level == 0 ? 0.0 : 1.0;
        to_smoothness(planes, shortest_.data(), widen, count, low_.data());
        to_smoothness(planes, longest_.data(), widen, count, high_.data());
        for (std::size_t i = 0; i < count; ++i) {
            nearest[i] = std::clamp(found[i], low_[i], high_[i]);
        }
    }

  private:
    bool cones_;
    std::size_t cone_plane_;
    std::vector<double> shortest_, longest_, low_, high_;
};

// Planes of intensity, squared roughness, and what the height map gives.
class GlossRows final : public Rows {
  public:
    GlossRows(std::span<const float> gloss, const NormalRows &height_map, std::size_t columns)
        : gloss_(gloss, columns, 2), height_map_(height_map), columns_(columns), smoothness_(columns) {}
    std::size_t channels() const override { return 2 + height_map_.channels(); }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<GlossRows>(*this); }
    void row(std::size_t y, double *out) override {
        gloss_.row(y, out);
        std::copy_n(out + columns_, columns_, smoothness_.begin());
        to_variance(smoothness_.data(), columns_, out + columns_);
        height_map_.row(y, out + 2 * columns_);
    }

  private:
    ValueRows gloss_;
    NormalRows height_map_;
    std::size_t columns_;
    std::vector<double> smoothness_;
};

class GlossComparer final : public MapComparer {
  public:
    GlossComparer(const TextureView &texture, const HeightMap &height_map, RowSums &sums)
        : MapComparer(texture, 2, sums), masked_(!height_map.islands.empty()),
          smoothness_(height_map, texture.size.columns), truth_(texture.size.columns),
          found_(texture.size.columns), errors_(2 * texture.size.columns), squares_(texture.size.columns) {}

    void row(std::size_t level, std::size_t y, const double *truth) override {
        const std::size_t count = columns(level);
        std::size_t kept = 0;
        double sum = 0.0;
        for (std::size_t c = 0; c < 2; ++c) {
            decoded(level, y, c, found_.data());
            if (c == 1) {
                smoothness_.nearest(truth + count, level, count, found_.data(), truth_.data());
            }
            double *errors = &errors_[kept];
            differences(c == 0 ? truth : truth_.data(), found_.data(), count, errors, squares_.data());
            std::size_t inside = count;
            if (masked_) {
                inside = only_inside(errors, truth + 5 * count, count);
                for (std::size_t i = 0; i < inside; ++i) {
                    squares_[i] = errors[i] * errors[i];
                }
            }
            sum += ordered_sum({squares_.data(), inside});
            kept += inside;
        }
        take(level, y, {errors_.data(), kept}, sum);
    }

  private:
    bool masked_;
    Smoothness smoothness_;
    std::vector<double> truth_;
    std::vector<double> found_;
    std::vector<double> errors_;
    std::vector<double> squares_;
};

// The direction on the rim of each highlight, in a plane through the normal.
PARADIZE_CLONES void to_rims(const double *__restrict smoothness, std::size_t count, double *__restrict sine,
                             double *__restrict cosine) {
    for (std::size_t i = 0; i < count; ++i) {
        const double rough = 1.0 - smoothness[i];
        const double alpha = rough * rough;
        const double slope = (0x1.6a09e667f3bcdp+0 - 1.0) * alpha * alpha; // its square
        sine[i] = std::sqrt(slope / (1.0 + slope));
        cosine[i] = std::sqrt(1.0 / (1.0 + slope));
    }
}

class HighlightComparer final : public MapComparer {
  public:
    HighlightComparer(const TextureView &texture, const HeightMap &height_map, RowSums &sums)
        : MapComparer(texture, 1, sums), masked_(!height_map.islands.empty()),
          smoothness_(height_map, texture.size.columns), shown_(texture.size.columns),
          meant_(texture.size.columns), zeros_(texture.size.columns), degrees_(texture.size.columns) {
        for (std::vector<double> *plane : {&truth_x_, &truth_z_, &found_x_, &found_z_}) {
            plane->resize(texture.size.columns);
        }
    }

    void row(std::size_t level, std::size_t y, const double *truth) override {
        const std::size_t count = columns(level);
        decoded(level, y, 1, shown_.data());
        smoothness_.nearest(truth + count, level, count, shown_.data(), meant_.data());
        to_rims(meant_.data(), count, truth_x_.data(), truth_z_.data());
        to_rims(shown_.data(), count, found_x_.data(), found_z_.data());
        angles_between({truth_x_.data(), zeros_.data(), truth_z_.data()},
                       {found_x_.data(), zeros_.data(), found_z_.data()}, count, degrees_.data());
        const std::size_t inside = masked_ ? only_inside(degrees_.data(), truth + 5 * count, count) : count;
        take(level, y, {degrees_.data(), inside}, ordered_sum({degrees_.data(), inside}));
    }

  private:
    bool masked_;
    Smoothness smoothness_;
    std::vector<double> shown_;
    std::vector<double> meant_;
    std::vector<double> zeros_;
    std::vector<double> degrees_;
    std::vector<double> truth_x_, truth_z_, found_x_, found_z_;
};

template <typename GlossLike>
std::vector<LevelError> compare_gloss(const TextureView &texture, std::span<const float> gloss,
                                      const HeightMap &height_map, int threads) {
    const NormalRows normals(height_map);
    const GlossRows truth(gloss, normals, texture.size.columns);
    return compare_levels(texture, truth, threads, [&](RowSums &sums) {
        return std::make_unique<GlossLike>(texture, height_map, sums);
    });
}

} // namespace

std::vector<LevelError> value_levels(const TextureView &texture, std::span<const float> values,
                                     std::size_t channels, int threads) {
    const ValueRows truth(values, texture.size.columns, channels);
    return compare_levels(texture, truth, threads, [&](RowSums &sums) {
        return std::make_unique<ValueComparer>(texture, channels, sums);
    });
}

std::vector<LevelError> gloss_levels(const TextureView &texture, std::span<const float> gloss,
                                     const HeightMap &height_map, int threads) {
    return compare_gloss<GlossComparer>(texture, gloss, height_map, threads);
}

std::vector<LevelError> highlight_levels(const TextureView &texture, std::span<const float> gloss,
                                         const HeightMap &height_map, int threads) {
    return compare_gloss<HighlightComparer>(texture, gloss, height_map, threads);
}

} // namespace paradize::reference
