// Tangent frames without MikkTSpace's rules.
#pragma once

#include <span>

#include "mesh/tangents.hpp"

namespace paradize::mesh {

// out: (m, 3) frame of every corner, from the direction of growing u of its own face (Method::face), or of
// the mean of the faces at its vertex that have the same handedness (Method::vertex). A face without area
// takes the mean of its vertex, or any unit vector at right angles to the normal with w = 1.
void simple_tangents(const Surface &surface, Method method, std::span<Frame> out);

} // namespace paradize::mesh
