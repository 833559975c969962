// Patches of a map, and their spectrum.
#pragma once

#include "filter/choose.hpp"

namespace paradize::filter {

struct Patch {
    std::size_t y;
    std::size_t x;
};

// Patches of one size, evenly over the map.
struct Patches {
    std::size_t height = 1;
    std::size_t width = 1;
    std::vector<Patch> at;
};

// The largest patches, evenly over the map, that lie on one island each.
Patches patches_of(const Map &map);

// Mean power (height * width) of the patches, each less its best quadratic: white noise of variance s has s
// in every bin.
std::vector<double> power_spectrum(const Map &map, const Patches &patches);

} // namespace paradize::filter
