#include "reference/maps/chain.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#include "parallel.hpp"
#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t step_rows = 64; // rows that one step of work makes, where sizes halve evenly

PARADIZE_CLONES void add_scaled(const double *__restrict from, std::size_t count, double weight,
                                double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] += weight * from[i];
    }
}

PARADIZE_CLONES void add_pairs(const double *__restrict from, std::size_t count, double weight,
                               double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] += weight * (from[2 * i] + from[2 * i + 1]);
    }
}

// Rows of a level whose texels cut those of level 0.
class BoxRows final : public Rows {
  public:
    BoxRows(const Rows &level0, Size size, Size to)
        : level0_(level0.fresh()), size_(size), to_(to), row_(channels() * size.columns), sum_(row_.size()) {}
    std::size_t channels() const override { return level0_->channels(); }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<BoxRows>(*level0_, size_, to_); }

    void row(std::size_t y, double *out) override {
        std::fill(sum_.begin(), sum_.end(), 0.0);
        each_part(y, size_.rows, to_.rows, [&](std::size_t from, double weight) {
            level0_->row(from, row_.data());
            add_scaled(row_.data(), row_.size(), weight, sum_.data());
        });
        for (std::size_t c = 0; c < channels(); ++c) {
            const double *line = &sum_[c * size_.columns];
            for (std::size_t x = 0; x < to_.columns; ++x) {
                double mean = 0.0;
                each_part(x, size_.columns, to_.columns,
                          [&](std::size_t from, double weight) { mean += weight * line[from]; });
                out[c * to_.columns + x] = mean;
            }
        }
    }

  private:
    // Texels of [0, from) that part `index` of [0, to) covers, and how much of it each is. In units of
    // 1 / (from to) of the whole, a texel is `to` long and a part `from`.
    template <typename Work>
    static void each_part(std::size_t index, std::size_t from, std::size_t to, Work &&work) {
        const std::size_t begin = index * from;
        const std::size_t end = begin + from;
        for (std::size_t at = begin / to; at * to < end; ++at) {
            const std::size_t overlap = std::min(end, (at + 1) * to) - std::max(begin, at * to);
            work(at, static_cast<double>(overlap) / static_cast<double>(from));
        }
    }

    std::unique_ptr<Rows> level0_;
    Size size_;
    Size to_;
    std::vector<double> row_;
    std::vector<double> sum_;
};

// Rows that were kept.
class HeldRows final : public Rows {
  public:
    HeldRows(const std::vector<double> &rows, std::size_t channels, std::size_t columns)
        : rows_(&rows), channels_(channels), columns_(columns) {}
    std::size_t channels() const override { return channels_; }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<HeldRows>(*this); }
    void row(std::size_t y, double *out) override {
        const std::size_t count = channels_ * columns_;
        std::copy_n(rows_->begin() + static_cast<std::ptrdiff_t>(y * count), count, out);
    }

  private:
    const std::vector<double> *rows_;
    std::size_t channels_;
    std::size_t columns_;
};

// A run of levels, first to last, each of whose texels is made of whole texels of the level before.
struct Run {
    std::size_t first;
    std::size_t last;
    bool shown; // the first level was shown before, as the last of another run
};

bool whole(Size finer, Size coarser) {
    return finer.rows % coarser.rows == 0 && finer.columns % coarser.columns == 0;
}

// The end of a run that starts at `first`: as far as sizes divide, and not so far that there is no work to
// share.
Run run_from(Size size, std::size_t levels, std::size_t first, bool shown) {
    const Size root = level_size(size, first);
    std::size_t last = first;
    while (last + 1 < levels && whole(level_size(size, last), level_size(size, last + 1)) &&
           root.rows / level_size(size, last + 1).rows <= step_rows) {
        ++last;
    }
    return {first, last, shown};
}

// One thread's rows of a run: each row is made of those of the level before when it is asked for.
class Cascade {
  public:
    Cascade(Size size, Run run, const Rows &source, Comparer &comparer)
        : size_(size), run_(run), source_(source.fresh()), comparer_(&comparer),
          lines_(run.last - run.first + 1) {
        for (std::size_t k = run.first; k <= run.last; ++k) {
            lines_[k - run.first].resize(source_->channels() * level_size(size, k).columns);
        }
    }

    const std::vector<double> &row(std::size_t level, std::size_t y) {
        std::vector<double> &line = lines_[level - run_.first];
        if (level == run_.first) {
            source_->row(y, line.data());
        } else {
            gather(level, y, line);
        }
        if (level > run_.first || !run_.shown) {
            comparer_->row(level, y, line.data());
        }
        return line;
    }

  private:
    void gather(std::size_t level, std::size_t y, std::vector<double> &line) {
        const Size finer = level_size(size_, level - 1);
        const Size here = level_size(size_, level);
        const std::size_t down = finer.rows / here.rows;
        const std::size_t across = finer.columns / here.columns;
        const double weight = 1.0 / static_cast<double>(down * across);
        std::fill(line.begin(), line.end(), 0.0);
        for (std::size_t j = 0; j < down; ++j) {
            const std::vector<double> &from = row(level - 1, y * down + j);
            if (across == 1) {
                add_scaled(from.data(), from.size(), weight, line.data());
            } else if (across == 2) { // planes follow one another: pairs never mix two of them
                add_pairs(from.data(), line.size(), weight, line.data());
            } else {
                for (std::size_t i = 0; i < from.size(); ++i) {
                    line[i / across] += weight * from[i];
                }
            }
        }
    }

    Size size_;
    Run run_;
    std::unique_ptr<Rows> source_;
    Comparer *comparer_;
    std::vector<std::vector<double>> lines_;
};

// All rows of a run; those of its last level are kept where `held` is given.
void feed_run(Size size, Run run, const Rows &source, std::span<const std::unique_ptr<Comparer>> comparers,
              std::vector<double> *held) {
    const Size end = level_size(size, run.last);
    const std::size_t count = source.channels() * end.columns;
    if (held != nullptr) {
        held->resize(count * end.rows);
    }
    std::atomic<std::size_t> next = 0;
    for_rows(std::min(comparers.size(), end.rows), static_cast<int>(comparers.size()),
             [&](std::size_t first, std::size_t last) {
                 for (std::size_t thread = first; thread < last; ++thread) {
                     Cascade cascade(size, run, source, *comparers[thread]);
                     for (std::size_t y = next++; y < end.rows; y = next++) {
                         const std::vector<double> &row = cascade.row(run.last, y);
                         if (held != nullptr) {
                             std::copy(row.begin(), row.end(),
                                       held->begin() + static_cast<std::ptrdiff_t>(y * count));
                         }
                     }
                 }
             });
}

} // namespace

PARADIZE_CLONES void widen(const float *__restrict from, std::size_t count, double *__restrict to) {
    for (std::size_t i = 0; i < count; ++i) {
        to[i] = from[i];
    }
}

void feed_levels(Size size, std::size_t levels, const Rows &level0,
                 std::span<const std::unique_ptr<Comparer>> comparers) {
    std::vector<double> held;
    std::vector<double> kept;
    std::unique_ptr<Rows> source = level0.fresh();
    Run run = run_from(size, levels, 0, false);
    for (;;) {
        const std::size_t after = run.last + 1;
        const bool more = after < levels;
        const bool divides = more && whole(level_size(size, run.last), level_size(size, after));
        feed_run(size, run, *source, comparers, divides ? &kept : nullptr);
        if (!more) {
            return;
        }
        if (divides) {
            std::swap(held, kept);
            source = std::make_unique<HeldRows>(held, level0.channels(), level_size(size, run.last).columns);
            run = run_from(size, levels, run.last, true);
        } else {
            source = std::make_unique<BoxRows>(level0, size, level_size(size, after));
            run = run_from(size, levels, after, false);
        }
    }
}

} // namespace paradize::reference
