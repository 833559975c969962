// Charts of a surface: which triangles are laid out together, and where each of their corners comes to lie in
// the chart's own plane.
// Sources: M. Garland, A. Willmott and P. Heckbert, "Hierarchical face clustering on polygonal surfaces",
// 2001; L. Liu, L. Zhang, Y. Xu, C. Gotsman and S. Gortler, "A local/global approach to mesh
// parameterization", 2008.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::atlas {

struct Surface {
    std::span<const double> positions;        // (n, 3), finite, about the origin, of a size near 1
    std::span<const std::uint32_t> triangles; // (m, 3), m > 0, each below n; one index per place
};

struct Charts {
    std::vector<std::int32_t> chart; // (m): which chart a triangle is in, 0 to count - 1
    std::vector<double> corners;     // (m, 3, 2): places in the chart's plane, in the positions' unit
    std::int32_t count = 0;
};

// deviation: how far a chart may be from flat: 1 less the length of its mean normal, above 0 and below 1.
// Every chart is laid out without a turned triangle and without lying over itself; what cannot be
// is cut until it can. Triangles without area lie where their corners come to lie. Triangles are
// neighbours where exactly two share an edge, once in each direction. most: where there are more charts than
// that before any is cut, nothing but their number is returned. threads: 1 or more; the result does not
// depend on it.
Charts make_charts(const Surface &surface, double deviation, std::int32_t most, int threads);

} // namespace paradize::atlas
