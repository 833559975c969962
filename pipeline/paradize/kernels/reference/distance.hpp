// How far two surfaces are apart, measured by dense sampling. For metrics only: no stage uses this kernel.
// Source of the method: P. Cignoni, C. Rocchini and R. Scopigno, "Metro: measuring error on simplified
// surfaces", 1998.
#pragma once

#include <cstdint>
#include <vector>

#include "reference/tree.hpp"

namespace paradize::reference {

struct Distance {
    double max =
        0; // largest of the samples, the vertices and the edge midpoints; reference/bound.hpp bounds it
    double rms = 0;                  // over area
    double p99 = 0;                  // the distance that 99 % of the area does not exceed
    std::vector<std::uint32_t> near; // by triangle of `from`: the slot of one of `to` near it
};

// From every sample of `from` to the nearest point of `to`, in float64. Samples: at least ten in every
// triangle, and in proportion to area so that there are about `samples` in all, at the points of a
// low-discrepancy sequence (the same on every machine). threads: 1 or more; the result does not depend on it.
Distance one_sided(const Tree &from, const Tree &to, std::uint64_t samples, unsigned threads);
Distance one_sided(const Surface &from, const Surface &to, std::uint64_t samples, unsigned threads);

} // namespace paradize::reference
