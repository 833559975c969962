#include <algorithm>

#include "parallel.hpp"
#include "reference/maps/angle.hpp"
#include "reference/maps/comparers.hpp"
#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

// Planes x, y and z of vectors of one row.
class Vectors {
  public:
    explicit Vectors(std::size_t columns) : values_(3 * columns) {}
    Directions of(std::size_t columns) {
        return {values_.data(), values_.data() + columns, values_.data() + 2 * columns};
    }

  private:
    std::vector<double> values_;
};

// Angles less what is open, not below 0.
PARADIZE_CLONES void beyond(const double *__restrict open, std::size_t count, double *__restrict angles) {
    for (std::size_t i = 0; i < count; ++i) {
        const double rest = angles[i] - open[i];
        angles[i] = rest > 0.0 ? rest : 0.0;
    }
}

// Truth: planes x, y, z of averaged normals; or, of du/dv, x and y. Then a mask, where there are islands.
// Then the mean of the cones, where there are: so far a normal is no error.
class AngleComparer final : public MapComparer {
  public:
    AngleComparer(const TextureView &texture, bool offsets, bool masked, bool cones, RowSums &sums)
        : MapComparer(texture, 1, sums), offsets_(offsets), masked_(masked), cones_(cones),
          truth_(texture.size.columns), found_(texture.size.columns), xy_(2 * texture.size.columns),
          angles_(texture.size.columns) {}

    void row(std::size_t level, std::size_t y, const double *truth) override {
        const std::size_t count = columns(level);
        const Directions exact = truth_.of(count);
        const Directions baked = found_.of(count);
        if (offsets_) {
            rebuild(truth, truth + count, count, exact);
        } else {
            normalise(truth, truth + count, truth + 2 * count, count, exact);
        }
        decoded(level, y, 0, xy_.data());
        decoded(level, y, 1, xy_.data() + count);
        rebuild(xy_.data(), xy_.data() + count, count, baked);
        angles_between(exact, baked, count, angles_.data());
        const double *rest = truth + (offsets_ ? 2 : 3) * count;
        if (cones_) {
            beyond(rest + (masked_ ? count : 0), count, angles_.data());
        }
        const std::size_t kept = masked_ ? only_inside(angles_.data(), rest, count) : count;
        take(level, y, {angles_.data(), kept}, ordered_sum({angles_.data(), kept}));
    }

  private:
    bool offsets_;
    bool masked_;
    bool cones_;
    Vectors truth_;
    Vectors found_;
    std::vector<double> xy_;
    std::vector<double> angles_;
};

// x and y of normals less a mean, and what follows the normals.
class OffsetRows final : public Rows {
  public:
    OffsetRows(const NormalRows &height_map, std::size_t columns, double mean_x, double mean_y)
        : height_map_(height_map), columns_(columns), mean_x_(mean_x), mean_y_(mean_y),
          planes_(height_map.channels() * columns) {}
    std::size_t channels() const override { return height_map_.channels() - 1; }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<OffsetRows>(*this); }
    void row(std::size_t y, double *out) override {
        height_map_.row(y, planes_.data());
        for (std::size_t i = 0; i < columns_; ++i) {
            out[i] = planes_[i] - mean_x_;
            out[columns_ + i] = planes_[columns_ + i] - mean_y_;
        }
        std::copy(planes_.begin() + static_cast<std::ptrdiff_t>(3 * columns_), planes_.end(),
                  out + 2 * columns_);
    }

  private:
    NormalRows height_map_;
    std::size_t columns_;
    double mean_x_;
    double mean_y_;
    std::vector<double> planes_;
};

struct Mean {
    double x;
    double y;
};

// The mean x and y of normals, over the islands' insides where there are islands.
Mean mean_of(const NormalRows &height_map, Size size, bool masked, int threads) {
    std::vector<double> sum_x(size.rows);
    std::vector<double> sum_y(size.rows);
    std::vector<double> counts(size.rows);
    for_rows(size.rows, threads, [&](std::size_t first, std::size_t last) {
        const std::unique_ptr<Rows> rows = height_map.fresh();
        std::vector<double> planes(rows->channels() * size.columns);
        for (std::size_t y = first; y < last; ++y) {
            rows->row(y, planes.data());
            double *x_plane = planes.data();
            double *y_plane = x_plane + size.columns;
            counts[y] = static_cast<double>(size.columns);
            if (masked) {
                const double *mask = planes.data() + 3 * size.columns;
                for (std::size_t i = 0; i < size.columns; ++i) {
                    x_plane[i] *= mask[i];
                    y_plane[i] *= mask[i];
                }
                counts[y] = ordered_sum({mask, size.columns});
            }
            sum_x[y] = ordered_sum({x_plane, size.columns});
            sum_y[y] = ordered_sum({y_plane, size.columns});
        }
    });
    const double count = std::max(1.0, ordered_sum(counts));
    return {ordered_sum(sum_x) / count, ordered_sum(sum_y) / count};
}

// The statistics of the angles of all rows. make() gives a function of a row and room for its angles, which
// returns how many there are; one for each part of the rows.
template <typename Make>
LevelError tallied(Size size, int threads, Make &&make) {
    const std::size_t keep = above_p99(size.rows * size.columns);
    std::vector<double> sums(size.rows);
    std::vector<std::size_t> counts(size.rows);
    std::vector<Largest> largest(static_cast<std::size_t>(std::max(1, threads)), Largest(keep));
    for_rows(largest.size(), static_cast<int>(largest.size()), [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part) {
            auto angles_of = make();
            std::vector<double> angles(size.columns);
            const std::size_t last = size.rows * (part + 1) / largest.size();
            for (std::size_t y = size.rows * part / largest.size(); y < last; ++y) {
                counts[y] = angles_of(y, angles.data());
                sums[y] = ordered_sum({angles.data(), counts[y]});
                largest[part].add({angles.data(), counts[y]});
            }
        }
    });
    for (std::size_t part = 1; part < largest.size(); ++part) {
        largest[0].join(largest[part]);
    }
    LevelError out;
    for (const std::size_t count : counts) {
        out.count += count;
    }
    out.sum = ordered_sum(sums);
    out.p99 = out.count == 0 ? 0.0 : largest[0].kth(above_p99(out.count));
    out.max = out.count == 0 ? 0.0 : largest[0].kth(1);
    return out;
}

} // namespace

std::vector<LevelError> normal_levels(const TextureView &texture, const HeightMap &height_map, int threads) {
    const NormalRows truth(height_map);
    const bool masked = !height_map.islands.empty();
    return compare_levels(texture, truth, threads, [&](RowSums &sums) {
        return std::make_unique<AngleComparer>(texture, false, masked, height_map.cones, sums);
    });
}

std::vector<LevelError> offset_levels(const TextureView &texture, const HeightMap &height_map, int threads) {
    const NormalRows normals(height_map);
    const bool masked = !height_map.islands.empty();
    const Mean mean = mean_of(normals, height_map.size, masked, threads);
    const OffsetRows truth(normals, height_map.size.columns, mean.x, mean.y);
    return compare_levels(texture, truth, threads, [&](RowSums &sums) {
        return std::make_unique<AngleComparer>(texture, true, masked, height_map.cones, sums);
    });
}

LevelError filter_angles(const HeightMap &height_map, const HeightMap &other, int threads) {
    const NormalRows one(height_map);
    const NormalRows two(other);
    const std::size_t columns = height_map.size.columns;
    const bool masked = !height_map.islands.empty() && !other.islands.empty();
    return tallied(height_map.size, threads, [&] {
        return
            [&, a = one.fresh(), b = two.fresh(), first = std::vector<double>(one.channels() * columns),
             second = std::vector<double>(two.channels() * columns)](std::size_t y, double *angles) mutable {
                a->row(y, first.data());
                b->row(y, second.data());
                angles_between({first.data(), first.data() + columns, first.data() + 2 * columns},
                               {second.data(), second.data() + columns, second.data() + 2 * columns}, columns,
                               angles);
                if (other.cones) {
                    beyond(second.data() + two.cone_plane() * columns, columns, angles);
                }
                if (!masked) {
                    return columns;
                }
                double *mask = first.data() + 3 * columns;
                for (std::size_t x = 0; x < columns; ++x) {
                    mask[x] *= second[3 * columns + x];
                }
                return only_inside(angles, mask, columns);
            };
    });
}

LevelError open_angles(const HeightMap &height_map, int threads) {
    const NormalRows truth(height_map);
    const std::size_t columns = height_map.size.columns;
    return tallied(height_map.size, threads, [&] {
        return [&, rows = truth.fresh(), planes = std::vector<double>(truth.channels() * columns)](
                   std::size_t y, double *angles) mutable {
            rows->row(y, planes.data());
            const double *cones = planes.data() + truth.cone_plane() * columns;
            std::copy(cones, cones + columns, angles);
            return height_map.islands.empty() ? columns
                                              : only_inside(angles, planes.data() + 3 * columns, columns);
        };
    });
}

} // namespace paradize::reference
