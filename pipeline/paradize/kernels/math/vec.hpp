// Three doubles, for the mesh kernels. Inputs are float32; all arithmetic is float64.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::mesh {

struct Vec {
    double x = 0, y = 0, z = 0;
    friend Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
    bool operator==(const Vec &) const = default;
};

inline double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec cross(Vec a, Vec b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec a) {
    return std::sqrt(dot(a, a));
}

// Unit vector, or zero for a vector without a direction. Scaled first: squares neither overflow nor vanish.
inline Vec unit(Vec a) {
    const double largest = std::fmax(std::fabs(a.x), std::fmax(std::fabs(a.y), std::fabs(a.z)));
    if (!(largest > 0) || !std::isfinite(largest))
        return {};
    const Vec scaled{a.x / largest, a.y / largest, a.z / largest};
    return (1 / length(scaled)) * scaled;
}

// Some unit vector at right angles to the unit vector n.
inline Vec any_perpendicular(Vec n) {
    const double x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
    const Vec axis = x <= y && x <= z ? Vec{1, 0, 0} : y <= z ? Vec{0, 1, 0} : Vec{0, 0, 1};
    return unit(axis - dot(axis, n) * n);
}

inline Vec at3(std::span<const float> rows, std::size_t i) {
    return {rows[i * 3], rows[i * 3 + 1], rows[i * 3 + 2]};
}

inline void put3(std::span<float> rows, std::size_t i, Vec v) {
    rows[i * 3] = static_cast<float>(v.x);
    rows[i * 3 + 1] = static_cast<float>(v.y);
    rows[i * 3 + 2] = static_cast<float>(v.z);
}

} // namespace paradize::mesh
