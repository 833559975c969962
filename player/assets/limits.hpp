#pragma once
// Limits that scene.json and the artifacts have in common.

namespace paradize::assets {

inline constexpr double max_length_m = 1e7;    // of lengths and of a vertex coordinate
inline constexpr double max_position_m = 1e10; // of a coordinate in object or world space

} // namespace paradize::assets
