// The rows around the one that is being worked on, extended on all sides.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "normals/types.hpp"

namespace paradize::normals {

// Where the rows of heights come from.
class Source {
  public:
    virtual ~Source() = default;
    // Writes row y, as many heights as there are columns; `margin` more may be overwritten.
    virtual void read(std::size_t y, float *to) = 0;
};

// A place along one axis, possibly outside: the texel to read, and for an odd reflection the texel about
// which it is reflected: h = 2 h[about] - h[at].
struct Tap {
    std::size_t at;
    std::size_t about;
    bool reflected;
};

inline Tap tap(std::ptrdiff_t i, std::size_t size, bool wrap) {
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

// `depth` rows on either side of one, each with `depth` columns more on either side. Real is float, or double
// for heights whose differences could overflow.
template <typename Real>
class Lines {
  public:
    Lines(Source &source, std::size_t rows, std::size_t columns, int depth, bool wrap_x, bool wrap_y)
        : source_(source), rows_(rows), columns_(columns), depth_(static_cast<std::size_t>(depth)),
          wrap_x_(wrap_x), wrap_y_(wrap_y), before_((depth_ + 15) / 16 * 16),
          stride_((before_ + columns + depth_ + 2 * margin + 15) / 16 * 16), count_(2 * depth_ + 1),
          values_(count_ * stride_ + 16), held_(count_, std::numeric_limits<std::ptrdiff_t>::min()) {
        constexpr std::size_t line = 64; // bytes of a cache line: whole vectors do not straddle two
        const std::size_t past = reinterpret_cast<std::uintptr_t>(values_.data()) % line;
        first_ = values_.data() + (past == 0 ? 0 : (line - past) / sizeof(Real));
    }
    Lines(const Lines &) = delete;
    Lines &operator=(const Lines &) = delete;

    // The row at y, possibly outside: column 0; valid until a row 2 * depth + 1 away is asked for.
    const Real *line(std::ptrdiff_t y) {
        bool fresh = false;
        return line(y, fresh);
    }

    // fresh: whether the row was not yet here.
    const Real *line(std::ptrdiff_t y, bool &fresh) {
        const std::size_t at = slot(y);
        Real *to = first_ + at * stride_ + before_;
        fresh = held_[at] != y;
        if (fresh) {
            held_[at] = std::numeric_limits<std::ptrdiff_t>::min();
            fill(y, to);
            held_[at] = y;
        }
        return to;
    }

    std::size_t slot(std::ptrdiff_t y) const {
        const auto n = static_cast<std::ptrdiff_t>(count_);
        return static_cast<std::size_t>(((y % n) + n) % n);
    }

    std::size_t count() const { return count_; }
    std::size_t stride() const { return stride_; }
    std::size_t before() const { return before_; }

  private:
    void read(std::size_t y, Real *to) {
        if constexpr (sizeof(Real) == sizeof(float)) {
            source_.read(y, to);
        } else {
            row_.resize(columns_ + margin);
            source_.read(y, row_.data());
            std::copy(row_.begin(), row_.begin() + static_cast<std::ptrdiff_t>(columns_), to);
        }
    }

    void fill(std::ptrdiff_t y, Real *to) {
        const Tap source = tap(y, rows_, wrap_y_);
        read(source.at, to);
        if (source.reflected) {
            about_.resize(columns_ + margin);
            read(source.about, about_.data());
            for (std::size_t x = 0; x < columns_; ++x) {
                to[x] = Real(2) * about_[x] - to[x];
            }
        }
        for (std::size_t k = 1; k <= depth_; ++k) {
            const auto left = -static_cast<std::ptrdiff_t>(k);
            const auto right = static_cast<std::ptrdiff_t>(columns_ + k - 1);
            for (const std::ptrdiff_t x : {left, right}) {
                const Tap column = tap(x, columns_, wrap_x_);
                to[x] = column.reflected ? Real(2) * to[column.about] - to[column.at] : to[column.at];
            }
        }
    }

    Source &source_;
    std::size_t rows_;
    std::size_t columns_;
    std::size_t depth_;
    bool wrap_x_;
    bool wrap_y_;
    std::size_t before_;
    std::size_t stride_;
    std::size_t count_;
    std::vector<Real> values_;
    Real *first_ = nullptr; // in values_, at the start of a cache line
    std::vector<std::ptrdiff_t> held_;
    std::vector<float> row_;
    std::vector<Real> about_;
};

} // namespace paradize::normals
