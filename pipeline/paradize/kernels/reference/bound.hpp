// The largest distance between two surfaces, between two bounds. For metrics only: no stage uses this kernel.
// A triangle of one surface is held against the nearest one of the other: its part that is no farther from
// that than the largest distance known is cut away (reference/cover.hpp), and what is left is held against
// others. Sources of the bounds: M. Guthe, P. Borodin and R. Klein, "Fast and accurate Hausdorff distance
// calculation between meshes", 2005; L. Sacht and A. Jacobson, "Cascading upper bounds for triangle soup
// Pompeiu-Hausdorff distance", 2024.
#pragma once

#include <cstdint>
#include <span>

#include "reference/tree.hpp"

namespace paradize::reference {

struct Bounds {
    double least = 0; // a point of one surface lies this far from the other
    double most = 0;  // no point of either lies farther, but for the rounding of float64
};

// The same with what samples tell (reference/distance.hpp), each the larger of both directions.
struct TwoSided {
    Bounds max;
    double rms = 0;
    double p99 = 0;
};

struct Closeness {
    double gap = 0.02;     // `most` is at most (1 + gap) * least ...
    double resolution = 0; // ... or least + resolution (in the positions' unit) ...
    // ... unless a place was held against so many triangles before. Each triangle is held against its `near`
    // one whatever the limit, so that `most` is finite.
    std::uint64_t tests = ~0u;
};

// near: (m,) for every triangle of `from` the slot of one of `to` near it; any choice is right, a near one is
// quick. least: a distance known to be reached. threads: 1 or more; the result does not depend on it.
Bounds farthest(const Tree &from, const Tree &to, std::span<const std::uint32_t> near, double least,
                const Closeness &closeness, unsigned threads);

// samples: as one_sided. gap, resolution: as Closeness has them, `resolution` of the first one's diagonal.
// Each direction ends after 60 million tests of a place against a triangle and 600 for each triangle of both;
// a look-up of the nearest counts for 16, and for more where it tests many triangles.
TwoSided two_sided(const Tree &a, const Tree &b, std::uint64_t samples, double gap, double resolution,
                   unsigned threads);

} // namespace paradize::reference
