// Points nearer to each other than a tolerance -> one point each.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::mesh {

// positions: (n, 3) finite, all different. tolerance: above 0, in their unit. Returns for each point the
// number of the point that stands for it: itself, or the nearest earlier one that stands for itself and is at
// most the tolerance away (of equally near ones the first). So no point goes farther than the tolerance, and
// those that stand for themselves are farther apart than it: a second call changes nothing.
std::vector<std::uint32_t> weld(std::span<const float> positions, double tolerance);

} // namespace paradize::mesh
