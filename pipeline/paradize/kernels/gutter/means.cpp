#include "gutter/means.hpp"

namespace paradize::gutter {

std::vector<Cover> covers(std::size_t fine, std::size_t coarse) {
    std::vector<Cover> found(coarse);
    for (std::size_t i = 0; i < coarse; ++i) {
        // In units of 1 / coarse of a fine cell all borders are whole numbers.
        const std::size_t begin = i * fine;
        const std::size_t end = begin + fine;
        found[i].first = begin / coarse;
        for (std::size_t k = found[i].first; k * coarse < end; ++k) {
            const std::size_t low = std::max(begin, k * coarse);
            const std::size_t high = std::min(end, (k + 1) * coarse);
            found[i].length[found[i].count++] = static_cast<float>(high - low) / static_cast<float>(fine);
        }
    }
    return found;
}

} // namespace paradize::gutter
