// One chart laid into the plane, as rigidly as it goes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "atlas/charts.hpp"

namespace paradize::atlas {

// Corners (k, 3, 2) of the triangles `own` of a surface, turned so that the smallest rectangle around them is
// upright; empty where a triangle would be turned over or the border would cross itself.
std::vector<double> flatten(const Surface &surface, std::span<const std::uint32_t> own);

// Corners (1, 3, 2) of a triangle by itself; on a line or a point where it has no area.
std::vector<double> own_shape(const Surface &surface, std::uint32_t triangle);

} // namespace paradize::atlas
