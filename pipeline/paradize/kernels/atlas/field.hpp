// The square of cells that charts are laid into, and where the next one fits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace paradize::atlas {

inline constexpr std::int32_t most_cells = 512; // a side; larger squares are packed by cells of some texels
// A field is wider than the square by the gutter, 64 cells at most.
inline constexpr std::int32_t field_cells = most_cells + 64;

struct Span {
    std::int32_t low, high; // cells [low, high)
    bool operator==(const Span &) const = default;
};

struct Placement {
    std::int32_t x = 0, y = 0, turn = 0;
};

// The cells that a chart covers, row by row, in one of its four turns.
struct Shape {
    std::vector<Span> rows;
    std::int32_t width = 0;
};

// A field of cells, at most `field_cells` wide and as high as it must be. Of each row there is a bit for
// every place where a run of free cells begins, for lengths of 1, 2, 4 and so on.
class Field {
  public:
    Field(std::int32_t width, std::int32_t most_rows) : width_(width), most_rows_(most_rows) {
        most_.reserve(static_cast<std::size_t>(most_rows));
    }

    // The lowest place from row `from`, of these the leftmost, where a widened shape meets nothing and whose
    // top stays below `below`; false where there is none.
    bool find(const Shape &shape, std::int32_t from, std::int32_t below, Placement &place);

    void take(const Shape &shape, std::int32_t x, std::int32_t y);

  private:
    static constexpr std::size_t words = field_cells / 64;
    using Bits = std::array<std::uint64_t, words>;

    // Leaves of `fits` the places from which a span of a row is free; whether any are left. Two runs, one
    // over the other, are a longer run.
    bool keep(Bits &fits, std::size_t row, Span span);

    void clear(std::size_t row, std::int32_t low, std::int32_t high);

    void grow(std::int32_t rows);

    std::int32_t width_, most_rows_;
    std::array<std::vector<std::uint64_t>, 10> runs_; // [k]: of 2^k cells; `words` a row
    std::vector<std::uint8_t> known_;                 // how many of `runs_` a row has
    std::vector<std::int32_t> most_;                  // no run of a row is longer
};

} // namespace paradize::atlas
