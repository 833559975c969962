#pragma once

#include <glm/gtc/constants.hpp>

namespace paradize {

/// A full turn, rad.
inline constexpr double turn = glm::two_pi<double>();

} // namespace paradize
