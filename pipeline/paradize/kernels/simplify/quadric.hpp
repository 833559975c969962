// Sums of squared distances to planes, and of squared differences to linear attributes, as quadratic forms.
#pragma once

#include <array>
#include <cstddef>

#include "math/vec.hpp"

namespace paradize::simplify {

using mesh::Vec;

// f(x) = x'Ax + 2 b'x + c, A symmetric.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    double x = 0, y = 0, z = 0;
    double c = 0;

    Quadric &operator+=(const Quadric &o) {
        xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
        x += o.x, y += o.y, z += o.z;
        c += o.c;
        return *this;
    }
    // Adds weight * (n'x + d)^2.
    void add(Vec n, double d, double weight) {
        const Vec w = weight * n;
        xx += w.x * n.x, xy += w.x * n.y, xz += w.x * n.z, yy += w.y * n.y, yz += w.y * n.z, zz += w.z * n.z;
        x += w.x * d, y += w.y * d, z += w.z * d;
        c += weight * d * d;
    }
    // Adds weight * (n'x)^2.
    void add_square(Vec n, double weight) {
        const Vec w = weight * n;
        xx += w.x * n.x, xy += w.x * n.y, xz += w.x * n.z, yy += w.y * n.y, yz += w.y * n.z, zz += w.z * n.z;
    }
    // The form of places that are counted from `at` on. With -at: a form about `at`, counted from the origin.
    void look_from(Vec at) {
        const Vec g = half_gradient(at);
        c += dot(at, g) + (x * at.x + y * at.y + z * at.z);
        x = g.x, y = g.y, z = g.z;
    }
    Vec half_gradient(Vec at) const {
        return {xx * at.x + xy * at.y + xz * at.z + x, xy * at.x + yy * at.y + yz * at.z + y,
                xz * at.x + yz * at.y + zz * at.z + z};
    }
    double value(Vec at) const {
        const Vec g = half_gradient(at);
        return dot(at, g) + (x * at.x + y * at.y + z * at.z) + c;
    }
    double trace() const { return xx + yy + zz; }
};

// The place, from the origin, where the form is least; along directions in which it hardly changes, not away
// from the origin. False where rounding leaves no such place. Tikhonov's method, iterated twice: what the
// damping leaves is damping squared.
inline bool least(const Quadric &q, double damping, Vec &at) {
    const double extra = damping * q.trace();
    if (!(extra > 0)) {
        return false;
    }
    // Cholesky, A = LL'.
    const double xx = q.xx + extra, yy = q.yy + extra, zz = q.zz + extra;
    const double i0 = 1.0 / std::sqrt(xx);
    const double l10 = q.xy * i0, l20 = q.xz * i0;
    const double d1 = yy - l10 * l10;
    if (!(d1 > 0)) {
        return false;
    }
    const double i1 = 1.0 / std::sqrt(d1);
    const double l21 = (q.yz - l20 * l10) * i1;
    const double d2 = zz - l20 * l20 - l21 * l21;
    if (!(d2 > 0)) {
        return false;
    }
    const double i2 = 1.0 / std::sqrt(d2);
    at = {};
    Vec g{q.x, q.y, q.z};
    for (int round = 0;; ++round) {
        const double u = g.x * i0;
        const double v = (g.y - l10 * u) * i1;
        const double w = (g.z - l20 * u - l21 * v) * i2;
        const double z = w * i2;
        const double y = (v - l21 * z) * i1;
        const double x = (u - l10 * y - l20 * z) * i0;
        at = {at.x - x, at.y - y, at.z - z};
        if (round == 1) {
            return true;
        }
        g = q.half_gradient(at);
    }
}

} // namespace paradize::simplify
