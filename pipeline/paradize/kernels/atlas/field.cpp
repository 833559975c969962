#include "atlas/field.hpp"

#include <algorithm>
#include <bit>

namespace paradize::atlas {
namespace {

// Word i of a row's bits moved down by `by`. What comes in from the next row is of places that nobody
// asks for: a run that begins there leaves the field.
std::uint64_t down(const std::uint64_t *bits, std::size_t i, std::int32_t by) {
    const auto at = i + static_cast<std::size_t>(by) / 64;
    return bits[at] >> by % 64 | bits[at + 1] << 1 << (63 - by % 64);
}

} // namespace

bool Field::find(const Shape &shape, std::int32_t from, std::int32_t below, Placement &place) {
    const auto height = static_cast<std::int32_t>(shape.rows.size());
    if (shape.width > width_) {
        return false;
    }
    Bits inside{}; // places from which the shape does not leave the field
    for (std::size_t i = 0; i < words; ++i) {
        const std::int32_t left = width_ - shape.width + 1 - static_cast<std::int32_t>(64 * i);
        inside[i] = left <= 0 ? 0 : ~std::uint64_t{0} >> (64 - std::min(left, 64));
    }
    // The widest row is asked first, later the one that was in the way.
    const auto length = [](const Span &span) { return span.high - span.low; };
    auto first =
        static_cast<std::size_t>(std::ranges::max_element(shape.rows, {}, length) - shape.rows.begin());
    for (std::int32_t y = from; y + height <= std::min(below - 1, most_rows_); ++y) {
        grow(y + height);
        Bits fits = inside;
        bool any = true;
        for (std::size_t n = 0; any && n < shape.rows.size(); ++n) {
            std::size_t r = n + first;
            r = r >= shape.rows.size() ? r - shape.rows.size() : r;
            const std::size_t row = static_cast<std::size_t>(y) + r;
            const Span span = shape.rows[r];
            any = length(span) <= most_[row] && keep(fits, row, span);
            if (!any && n == 0 && length(span) == shape.width) {
                most_[row] = std::min(most_[row], shape.width - 1);
            }
            first = any ? first : r;
        }
        if (any) {
            std::size_t word = 0;
            while (fits[word] == 0) {
                ++word;
            }
            place.x = static_cast<std::int32_t>(64 * word) + std::countr_zero(fits[word]);
            place.y = y;
            return true;
        }
    }
    return false;
}

void Field::take(const Shape &shape, std::int32_t x, std::int32_t y) {
    grow(y + static_cast<std::int32_t>(shape.rows.size()));
    for (std::size_t r = 0; r < shape.rows.size(); ++r) {
        const std::size_t row = static_cast<std::size_t>(y) + r;
        clear(row, x + shape.rows[r].low, x + shape.rows[r].high);
        known_[row] = 1;
    }
}

bool Field::keep(Bits &fits, std::size_t row, Span span) {
    const std::int32_t length = span.high - span.low;
    const auto level = static_cast<std::size_t>(std::bit_width(static_cast<std::uint32_t>(length)) - 1);
    for (; known_[row] <= level; ++known_[row]) {
        const std::uint64_t *half = runs_[known_[row] - 1].data() + words * row;
        std::uint64_t *whole = runs_[known_[row]].data() + words * row;
        for (std::size_t i = 0; i < words; ++i) {
            whole[i] = half[i] & down(half, i, 1 << (known_[row] - 1));
        }
    }
    const std::uint64_t *runs = runs_[level].data() + words * row;
    const std::int32_t more = span.high - (1 << level);
    std::uint64_t any = 0;
    for (std::size_t i = 0; i < words; ++i) {
        fits[i] &= down(runs, i, span.low) & down(runs, i, more);
        any |= fits[i];
    }
    return any != 0;
}

void Field::clear(std::size_t row, std::int32_t low, std::int32_t high) {
    std::uint64_t *const bits = runs_[0].data() + words * row;
    for (std::int32_t at = low; at < high;) {
        const std::int32_t end = std::min(high, at / 64 * 64 + 64);
        const std::uint64_t ones = ~std::uint64_t{0} >> (64 - (end - at));
        bits[at / 64] &= ~(ones << at % 64);
        at = end;
    }
}

void Field::grow(std::int32_t rows) {
    while (most_.size() < static_cast<std::size_t>(rows)) {
        most_.push_back(width_);
        known_.push_back(1);
        for (auto &runs : runs_) { // and as much behind the last row as a move may look at
            runs.resize(words * (most_.size() + 1) + 1);
        }
        std::fill_n(runs_[0].end() - words - words - 1, words, ~std::uint64_t{0});
        clear(most_.size() - 1, width_, field_cells);
    }
}

} // namespace paradize::atlas
