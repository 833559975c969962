// Tangent frames without MikkTSpace's rules.
#pragma once

#include <span>

#include "mesh/tangents/tangents.hpp"

namespace paradize::mesh {

// out: (m, 3) frame of every corner, from the mean direction of growing u of the faces at its vertex that
// have the same handedness as its own. A face without area takes either mean of its vertex, or any unit
// vector at right angles to the normal with w = 1.
void vertex_tangents(const Surface &surface, std::span<Frame> out);

} // namespace paradize::mesh
