// The border of a chart in the plane, and whether the chart lies over itself.
#pragma once

#include <span>

#include "atlas/plane.hpp"

namespace paradize::atlas {

// Whether a place of the plane is covered twice; always where the chart has no border. places: by the
// triangles' corners. No triangle may be turned over: then each place is covered as often as the border goes
// round it, so it is enough that the border's loops meet nowhere and that only one of them goes round
// anything.
bool overlaps_itself(std::span<const Triangle> triangles, std::span<const Vec> places);

} // namespace paradize::atlas
