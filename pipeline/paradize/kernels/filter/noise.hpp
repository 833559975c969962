// The noise of a map whose heights stand in steps.
#pragma once

#include "filter/patches.hpp"

namespace paradize::filter {

struct Steps {
    double step;     // root mean square distance of neighbouring values, 0: none found
    double variance; // of the rounding to them, in squared units of height
    bool found;      // the values themselves show the steps; else it is what the source's bits allow
};

// The distance from a value to its nearest neighbour among all values seen, where most values are seen often;
// else the step of the source's bits.
Steps steps_of(const Map &map, const Patches &patches);

// The power spectrum (height * width) of the rounding, whose mean is `steps.variance`.
std::vector<double> noise_spectrum(const Map &map, const Patches &patches, const Steps &steps);

} // namespace paradize::filter
