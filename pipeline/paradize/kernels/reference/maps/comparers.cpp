#include "reference/maps/comparers.hpp"

#include <cmath>

#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

PARADIZE_CLONES void subtract(const double *__restrict a, const double *__restrict b, std::size_t count,
                              double *__restrict apart, double *__restrict squares) {
    for (std::size_t i = 0; i < count; ++i) {
        const double d = a[i] - b[i];
        apart[i] = std::abs(d);
        squares[i] = d * d;
    }
}

} // namespace

double differences(const double *truth, const double *found, std::size_t count, double *errors,
                   double *squares) {
    subtract(truth, found, count, errors, squares);
    return ordered_sum({squares, count});
}

RowSums::RowSums(const TextureView &texture) : levels(texture.levels.size()) {
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const std::size_t rows = level_size(texture.size, k).rows;
        levels[k] = {std::vector<double>(rows), std::vector<std::uint64_t>(rows), std::vector<double>(rows)};
    }
}

MapComparer::MapComparer(const TextureView &texture, std::size_t errors_per_texel, RowSums &sums)
    : sums_(sums), size_(texture.size) {
    for (std::size_t k = 0; k < texture.levels.size(); ++k) {
        const Size size = level_size(size_, k);
        texels_.emplace_back(texture.format, texture.channels, size, texture.levels[k]);
        largest_.emplace_back(above_p99(size.rows * size.columns * errors_per_texel));
    }
}

void MapComparer::decoded(std::size_t level, std::size_t y, std::size_t c, double *to) {
    widen(texels_[level].row(y, c), columns(level), to);
}

void MapComparer::take(std::size_t level, std::size_t y, std::span<const double> errors, double sum) {
    sums_.levels[level].sums[y] = sum;
    sums_.levels[level].counts[y] = errors.size();
    largest_[level].add(errors);
}

std::size_t only_inside(double *errors, const double *mask, std::size_t count) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (mask[i] > 1.0 - 1e-9) {
            errors[kept++] = errors[i];
        }
    }
    return kept;
}

std::vector<LevelError> MapComparer::results(std::vector<std::unique_ptr<Comparer>> &comparers,
                                             const RowSums &sums) {
    std::vector<LevelError> out(sums.levels.size());
    auto &first = static_cast<MapComparer &>(*comparers[0]);
    for (std::size_t k = 0; k < out.size(); ++k) {
        for (std::size_t j = 1; j < comparers.size(); ++j) {
            first.largest_[k].join(static_cast<MapComparer &>(*comparers[j]).largest_[k]);
        }
        const RowSums::Level &level = sums.levels[k];
        out[k].sum = ordered_sum(level.sums);
        out[k].alpha_squares = ordered_sum(level.alpha_squares);
        for (const std::uint64_t count : level.counts) {
            out[k].count += count;
        }
        if (out[k].count > 0) {
            out[k].p99 = first.largest_[k].kth(above_p99(out[k].count));
            out[k].max = first.largest_[k].kth(1);
        }
    }
    return out;
}

} // namespace paradize::reference
