#include "reference/uv_tree.hpp"

#include <limits>

namespace paradize::reference {

UvTree::UvTree(const Tree &tree, std::span<const std::uint32_t> triangles, std::span<const float> uvs)
    : tree_(tree), corners_(tree.order().size()), boxes_(tree.nodes().size()) {
    for (std::size_t slot = 0; slot < corners_.size(); ++slot)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t axis = 0; axis < 2; ++axis)
                corners_[slot][k][axis] =
                    uvs[triangles[tree.order()[slot] * std::size_t{3} + k] * std::size_t{2} + axis];
    // A node's children stand behind it.
    for (std::size_t number = boxes_.size(); number-- > 0;)
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t axis = 0; axis < 2; ++axis) {
                double low = std::numeric_limits<double>::max(), high = -low;
                const std::uint64_t child = tree.nodes()[number].child[k];
                if (child == Tree::empty) {
                    // stays an empty box
                } else if (child & Tree::leaf_bit) {
                    const std::size_t first = (child & ~Tree::leaf_bit) >> 3, count = child & 7;
                    for (std::size_t slot = first; slot < first + count; ++slot)
                        for (const Uv &uv : corners_[slot]) {
                            low = std::min(low, uv[axis]);
                            high = std::max(high, uv[axis]);
                        }
                } else {
                    const Boxes &below = boxes_[child];
                    low = *std::min_element(below.low[axis], below.low[axis] + 4);
                    high = *std::max_element(below.high[axis], below.high[axis] + 4);
                }
                boxes_[number].low[axis][k] = low;
                boxes_[number].high[axis][k] = high;
            }
}

} // namespace paradize::reference
