#include "streaming/free_ranges.hpp"

#include <algorithm>
#include <iterator>

namespace paradize {

std::optional<std::size_t> FreeRanges::take(std::size_t count) {
    const auto found =
        std::ranges::find_if(ranges_, [&](const Range &range) { return range.count >= count; });
    if (found == ranges_.end()) {
        return std::nullopt;
    }
    const std::size_t first = found->first;
    found->first += count;
    found->count -= count;
    if (found->count == 0) {
        ranges_.erase(found);
    }
    return first;
}

void FreeRanges::give(std::size_t first, std::size_t count) {
    auto next = std::ranges::lower_bound(ranges_, first, {}, &Range::first);
    if (next != ranges_.begin() && std::prev(next)->first + std::prev(next)->count == first) {
        --next;
        next->count += count;
    } else {
        next = ranges_.insert(next, {first, count});
    }
    const auto after = std::next(next);
    if (after != ranges_.end() && next->first + next->count == after->first) {
        next->count += after->count;
        ranges_.erase(after);
    }
}

} // namespace paradize
