#pragma once
// Which parts of a buffer are free. Uses no GL.

#include <cstddef>
#include <optional>
#include <vector>

namespace paradize {

/// The free ranges among `size` elements; at first all are free.
class FreeRanges {
  public:
    explicit FreeRanges(std::size_t size) : ranges_{{0, size}} {}

    /// Takes the first range of so many elements; nullopt: no free range is that long. Returns where it
    /// begins.
    std::optional<std::size_t> take(std::size_t count);
    /// Gives back a range that was taken.
    void give(std::size_t first, std::size_t count);

  private:
    struct Range {
        std::size_t first = 0, count = 0;
    };
    std::vector<Range> ranges_; // ascending; no two touch
};

} // namespace paradize
