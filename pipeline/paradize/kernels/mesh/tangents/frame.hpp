// One tangent frame from a direction and a normal.
#pragma once

#include "math/vec.hpp"
#include "mesh/tangents/tangents.hpp"

namespace paradize::mesh {

inline Vec on_plane(Vec v, Vec normal) {
    return unit(v - dot(normal, v) * normal);
}

// t need not be unit; where it has no direction in the plane of the unit normal n, some other is taken.
inline Frame frame_of(Vec t, Vec n, float w) {
    t = on_plane(on_plane(t, n), n);
    if (t == Vec{})
        t = any_perpendicular(n);
    return {static_cast<float>(t.x), static_cast<float>(t.y), static_cast<float>(t.z), w};
}

inline float sign_of(bool preserves) {
    return preserves ? -1.0f : 1.0f; // v grows down the image, B points up
}

} // namespace paradize::mesh
