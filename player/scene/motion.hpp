#pragma once
// Where an instance that moves is at a moment of the flight. Uses no GL. pipeline/paradize/scene/motion.py
// has the same functions.

#include "assets/scene/file.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <cstdint>

namespace paradize {

struct Moved {
    glm::dmat4 stand{1.0}; // world from the object's space
    // of its wings or legs: phase in radians, angles of lift and swing, 0
    glm::vec4 beat{0.0F};
};

/// `number`: of the instance, in the order of scene.json; each begins at another place of its way. `share`:
/// of the flight's duration that has passed, 0 to 1. A function of these alone; at 1 it is what it was at 0.
Moved moved_at(const assets::Motion &motion, const assets::Placement &placement, std::uint32_t number,
               double share);

/// Returns how far an instance moves from its position, metres, at most.
double reach_of(const assets::Motion &motion);

} // namespace paradize
