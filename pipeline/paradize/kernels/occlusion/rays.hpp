// Rays from one point, as many at a time as the instruction set has lanes: include after defining
// PARADIZE_WIDTH and PARADIZE_LANES. Whether a ray meets a triangle does not depend on the rays beside it:
// boxes only spare work, and are tested a little wider than they are.
// Source of the widening: T. Ize, "Robust BVH ray traversal", 2013. A triangle is met where the ray is on one
// side of all three planes through the origin and an edge, so that no ray slips between neighbours.
#pragma once

#include "occlusion/cast.hpp"
#include "simd/lanes.hpp"

namespace paradize::occlusion::PARADIZE_WIDTH {

using side_by_side::PARADIZE_WIDTH::Lanes;
using side_by_side::PARADIZE_WIDTH::lanes;
typedef std::int32_t IntLanes __attribute__((vector_size(4 * PARADIZE_LANES)));
typedef float LanesAnywhere __attribute__((vector_size(4 * PARADIZE_LANES), aligned(4), may_alias));

PARADIZE_INLINE Lanes load(const float *from) {
    return *reinterpret_cast<const LanesAnywhere *>(from);
}

// A bit for each lane that is -1.
PARADIZE_INLINE std::uint32_t bits(const IntLanes &mask) {
#if PARADIZE_LANES == 16
    return _mm512_movepi32_mask((__m512i)mask);
#elif PARADIZE_LANES == 8
    return static_cast<std::uint32_t>(_mm256_movemask_ps((__m256)mask));
#elif defined(__SSE2__)
    return static_cast<std::uint32_t>(_mm_movemask_ps((__m128)mask));
#else
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
        found |= mask[i] != 0 ? 1U << i : 0U;
    }
    return found;
#endif
}

PARADIZE_INLINE Lanes least(const Lanes &a, const Lanes &b) {
    return a < b ? a : b;
}
PARADIZE_INLINE Lanes most(const Lanes &a, const Lanes &b) {
    return a > b ? a : b;
}

struct Rays {
    Lanes d[3], inverse[3];
};

constexpr float wider = 1.0F + 0x1p-20F; // far more than rounding of the distances

PARADIZE_INLINE std::uint32_t meets_box(const Node &node, const float *o, const Rays &rays, float reach) {
    Lanes near = {}, far = near + reach;
    for (int k = 0; k < 3; ++k) {
        const Lanes a = (node.low[k] - o[k]) * rays.inverse[k], b = (node.high[k] - o[k]) * rays.inverse[k];
        near = most(near, least(a, b));
        far = least(far, most(a, b) * wider);
    }
    return bits(near <= far * wider);
}

PARADIZE_INLINE std::uint32_t meets_triangle(const std::array<float, 9> &c, const float *o, const Rays &rays,
                                             float reach) {
    const float a[3] = {c[0] - o[0], c[1] - o[1], c[2] - o[2]};
    const float b[3] = {c[3] - o[0], c[4] - o[1], c[5] - o[2]};
    const float e[3] = {c[6] - o[0], c[7] - o[1], c[8] - o[2]};
    const auto side = [&](const float *p, const float *q) {
        const float x = p[1] * q[2] - p[2] * q[1], y = p[2] * q[0] - p[0] * q[2],
                    z = p[0] * q[1] - p[1] * q[0];
        return rays.d[0] * x + rays.d[1] * y + rays.d[2] * z;
    };
    const Lanes u = side(a, b), v = side(b, e), w = side(e, a), none = {};
    const IntLanes inside =
        ((u >= none) & (v >= none) & (w >= none)) | ((u <= none) & (v <= none) & (w <= none));
    if (bits(inside) == 0) {
        return 0;
    }
    const float p[3] = {c[3] - c[0], c[4] - c[1], c[5] - c[2]},
                q[3] = {c[6] - c[0], c[7] - c[1], c[8] - c[2]};
    const float n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    const float height = n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
    const Lanes t = height / (rays.d[0] * n[0] + rays.d[1] * n[1] + rays.d[2] * n[2]);
    return bits(inside & (t > none) & (t <= reach));
}

// Which of the rays in `active` meet a triangle.
static std::uint32_t meet(const Tree &tree, const float *o, const Rays &rays, std::uint32_t active,
                          float reach) {
    const std::uint32_t asked = active;
    std::uint32_t open[deepest + 1];
    std::size_t count = 0;
    if (!tree.nodes.empty()) {
        open[count++] = 0;
    }
    while (count > 0) {
        const std::uint32_t at = open[--count];
        const Node &node = tree.nodes[at];
        if ((meets_box(node, o, rays, reach) & active) == 0) {
            continue;
        }
        if (node.right == 0) {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                active &= ~meets_triangle(tree.corners[i], o, rays, reach);
            }
            if (active == 0) {
                break;
            }
            continue;
        }
        const bool left_first = rays.d[node.axis][0] >= 0;
        open[count++] = left_first ? node.right : at + 1;
        open[count++] = left_first ? at + 1 : node.right;
    }
    return asked & ~active;
}

Share cast(const Tree &tree, const Point &point, const float *x, const float *y, const float *z,
           std::size_t count, float reach) {
    Share share{0, 0};
    const Lanes none = {}, tiny = none + 1e-20F, one = none + 1.0F;
    for (std::size_t first = 0; first < count; first += lanes) {
        const Lanes dx = load(x + first), dy = load(y + first), dz = load(z + first);
        Rays rays;
        for (int k = 0; k < 3; ++k) {
            const Lanes d = dx * point.frame[0][k] + dy * point.frame[1][k] + dz * point.frame[2][k];
            rays.d[k] = d;
            const Lanes safe = d >= none ? most(d, tiny) : least(d, -tiny);
            rays.inverse[k] = one / safe;
        }
        const std::uint32_t counts =
            bits(rays.d[0] * point.face[0] + rays.d[1] * point.face[1] + rays.d[2] * point.face[2] > none);
        if (counts == 0) {
            continue;
        }
        const std::uint32_t met = meet(tree, point.origin, rays, counts, reach);
        share.all += static_cast<std::uint32_t>(__builtin_popcount(counts));
        share.open += static_cast<std::uint32_t>(__builtin_popcount(counts & ~met));
    }
    return share;
}

} // namespace paradize::occlusion::PARADIZE_WIDTH
