#include "mesh/tangents/faces.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "math/functions.hpp"
#include "simd/cpu.hpp"
#include "unify.hpp"

namespace paradize::mesh {
namespace {

constexpr std::size_t lanes = 32; // triangles measured together

// Corners' values by component: position, normal, uv. Edges: from corner 0 to 1, 0 to 2, 1 to 2.
struct Block {
    float in[3][8][lanes];
    double edge[3][3][lanes], across[3][lanes]; // across: at right angles to the face
    double s[3][lanes], ss[lanes];              // direction of growing u, and its square
    double turn[lanes];                         // 1, -1 where the image is mirrored, 0 where it has no area
    float pull[3][3][lanes];
    float down[3][lanes];
    std::uint32_t flags[lanes];
};

struct Vec3 {
    double x, y, z;
};
inline double dot3(const Vec3 &a, const Vec3 &b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// atan(q) for 0 <= q <= 1 within 2e-9: a polynomial in q^2 through Chebyshev's points.
inline double short_atan(double q) {
    const double z = q * q;
    double p = -0.00170117009;
    p = p * z + 0.0104876494;
    p = p * z - 0.03035186511;
    p = p * z + 0.05708955633;
    p = p * z - 0.08349724997;
    p = p * z + 0.1093234151;
    p = p * z - 0.1426001609;
    p = p * z + 0.1999807528;
    p = p * z - 0.3333327629;
    p = p * z + 0.9999999972;
    return p * q;
}

// The angle of the point (x, y), y >= 0; a right angle where both are zero.
inline double angle_of(double x, double y) {
    const double ax = std::fabs(x);
    const double large = ax > y ? ax : y, small = ax > y ? y : ax;
    const double known = large > 0 ? large : 1;
    const double part = short_atan(small / known);
    const double acute = ax > y ? part : mathx::half_pi - part;
    const double angle = x < 0 ? mathx::pi - acute : acute;
    return large > 0 ? angle : mathx::half_pi;
}

PARADIZE_CLONES void measure_images(Block &b) {
    constexpr double least = std::numeric_limits<float>::min(), most = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < lanes; ++i) {
        const double x0 = b.in[0][0][i], y0 = b.in[0][1][i], z0 = b.in[0][2][i];
        const double x1 = b.in[1][0][i], y1 = b.in[1][1][i], z1 = b.in[1][2][i];
        const double x2 = b.in[2][0][i], y2 = b.in[2][1][i], z2 = b.in[2][2][i];
        const Vec3 d1{x1 - x0, y1 - y0, z1 - z0}, d2{x2 - x0, y2 - y0, z2 - z0},
            d3{x2 - x1, y2 - y1, z2 - z1};
        // In float32 as the reference does: on slivers the sign of this area decides the split.
        const float t21x = b.in[1][6][i] - b.in[0][6][i], t21y = b.in[1][7][i] - b.in[0][7][i];
        const float t31x = b.in[2][6][i] - b.in[0][6][i], t31y = b.in[2][7][i] - b.in[0][7][i];
        const double area = t21x * t31y - t21y * t31x;
        const double e21x = t21x, e21y = t21y, e31x = t31x, e31y = t31y;
        const Vec3 s{e31y * d1.x - e21y * d2.x, e31y * d1.y - e21y * d2.y, e31y * d1.z - e21y * d2.z};
        const Vec3 t{e21x * d2.x - e31x * d1.x, e21x * d2.y - e31x * d1.y, e21x * d2.z - e31x * d1.z};
        const double size = std::fabs(area), bound = least * size;
        const double ss = dot3(s, s), tt = dot3(t, t);
        // Written so that NaN, of images too large for float32, has no area either.
        const bool sound = (size > least) & (size <= most) & (ss > bound * bound) & (tt > bound * bound);
        const double turn = sound ? (area > 0 ? 1.0 : -1.0) : 0.0;
        const double long_t = turn / std::sqrt(tt);
        b.down[0][i] = static_cast<float>(sound ? long_t * t.x : 0.0);
        b.down[1][i] = static_cast<float>(sound ? long_t * t.y : 0.0);
        b.down[2][i] = static_cast<float>(sound ? long_t * t.z : 0.0);
        b.turn[i] = turn;
        b.ss[i] = ss;
        b.s[0][i] = s.x, b.s[1][i] = s.y, b.s[2][i] = s.z;
        b.edge[0][0][i] = d1.x, b.edge[0][1][i] = d1.y, b.edge[0][2][i] = d1.z;
        b.edge[1][0][i] = d2.x, b.edge[1][1][i] = d2.y, b.edge[1][2][i] = d2.z;
        b.edge[2][0][i] = d3.x, b.edge[2][1][i] = d3.y, b.edge[2][2][i] = d3.z;
        b.across[0][i] = d1.y * d2.z - d1.z * d2.y;
        b.across[1][i] = d1.z * d2.x - d1.x * d2.z;
        b.across[2][i] = d1.x * d2.y - d1.y * d2.x;
        const std::uint32_t preserves = area > 0 ? face_preserves : 0u, any = sound ? 0u : face_any;
        const std::uint32_t flat =
            (dot3(d1, d1) == 0.0) | (dot3(d2, d2) == 0.0) | (dot3(d3, d3) == 0.0) ? face_flat : 0u;
        b.flags[i] = preserves | any | flat;
    }
}

// Corner k, between edges a and e; `way` is -1 where one of them runs to the corner.
PARADIZE_CLONES void measure_corners(Block &b, std::size_t k, std::size_t a, std::size_t e, double way) {
    const float(&normal)[8][lanes] = b.in[k];
    const double(&first)[3][lanes] = b.edge[a];
    const double(&second)[3][lanes] = b.edge[e];
    float(&pull)[3][lanes] = b.pull[k];
    for (std::size_t i = 0; i < lanes; ++i) {
        const Vec3 n{normal[3][i], normal[4][i], normal[5][i]};
        const Vec3 p{first[0][i], first[1][i], first[2][i]}, q{second[0][i], second[1][i], second[2][i]};
        const Vec3 around{b.across[0][i], b.across[1][i], b.across[2][i]};
        // Cosine and sine, times the same length, of the angle between the edges seen along the normal.
        const double cosine = way * (dot3(p, q) - dot3(n, p) * dot3(n, q));
        const double angle = angle_of(cosine, std::fabs(dot3(n, around)));
        const Vec3 s{b.s[0][i], b.s[1][i], b.s[2][i]};
        const double lean = dot3(n, s);
        const Vec3 flat{s.x - lean * n.x, s.y - lean * n.y, s.z - lean * n.z};
        const double ff = dot3(flat, flat);
        const bool has = ff > 1e-12 * b.ss[i]; // else u grows along the normal
        const double scale = b.turn[i] * angle / std::sqrt(ff);
        pull[0][i] = static_cast<float>(has ? scale * flat.x : 0.0);
        pull[1][i] = static_cast<float>(has ? scale * flat.y : 0.0);
        pull[2][i] = static_cast<float>(has ? scale * flat.z : 0.0);
    }
}

void measure(Block &b) {
    measure_images(b);
    measure_corners(b, 0, 0, 1, 1);
    measure_corners(b, 1, 0, 2, -1);
    measure_corners(b, 2, 1, 2, 1);
}

WeldedVertex spot_of(const Surface &surface, std::size_t i) {
    const float *const p = &surface.positions[i * 3], *const n = &surface.normals[i * 3],
                       *const t = &surface.uvs[i * 2];
    const double x = n[0], y = n[1], z = n[2], nn = x * x + y * y + z * z;
    const double scale = nn > 0 ? 1 / std::sqrt(nn) : 0;
    return {{p[0], p[1], p[2]},
            {static_cast<float>(scale * x), static_cast<float>(scale * y), static_cast<float>(scale * z)},
            {t[0], t[1]}};
}

} // namespace

Welded weld(const Surface &surface) {
    const std::size_t count = surface.positions.size() / 3;
    const auto word = [](float a, float b) { return std::uint64_t{float_key(a)} << 32 | float_key(b); };
    const auto hash = [&](std::size_t i) {
        const float *const p = &surface.positions[i * 3], *const n = &surface.normals[i * 3],
                           *const t = &surface.uvs[i * 2];
        std::uint64_t h = mix(hash_seed, word(p[0], p[1]));
        h = mix(h, word(p[2], n[0]));
        h = mix(h, word(n[1], n[2]));
        return mix(h, word(t[0], t[1]));
    };
    const auto equal = [&](std::size_t i, std::size_t j) {
        for (std::size_t k = 0; k < 3; ++k)
            if (surface.positions[i * 3 + k] != surface.positions[j * 3 + k] ||
                surface.normals[i * 3 + k] != surface.normals[j * 3 + k])
                return false;
        return surface.uvs[i * 2] == surface.uvs[j * 2] && surface.uvs[i * 2 + 1] == surface.uvs[j * 2 + 1];
    };
    Welded out{0, Buffer<std::uint32_t>(count), Buffer<std::uint32_t>(count), Buffer<WeldedVertex>(count)};
    // Open addressing; an entry is the hash's upper half and the number. Slots are fetched ahead.
    constexpr std::uint64_t empty = ~std::uint64_t{0}, upper = empty << 32;
    const std::size_t mask = std::bit_ceil(count * 2 + 1) - 1;
    Buffer<std::uint64_t> table(mask + 1);
    std::fill_n(table.data(), mask + 1, empty);
    constexpr std::size_t ahead = 16;
    std::uint64_t hashes[ahead];
    for (std::size_t i = 0; i < count + ahead; ++i) {
        if (i >= ahead) {
            const std::size_t at = i - ahead;
            const std::uint64_t h = hashes[at % ahead];
            std::size_t slot = h & mask;
            while (table[slot] != empty && !(((table[slot] ^ h) & upper) == 0 &&
                                             equal(out.first[static_cast<std::uint32_t>(table[slot])], at)))
                slot = (slot + 1) & mask;
            if (table[slot] == empty) {
                table[slot] = (h & upper) | out.count;
                out.first[out.count] = static_cast<std::uint32_t>(at);
                out.spots[out.count] = spot_of(surface, at);
                ++out.count;
            }
            out.number[at] = static_cast<std::uint32_t>(table[slot]);
        }
        if (i < count) {
            hashes[i % ahead] = hash(i);
            __builtin_prefetch(&table[hashes[i % ahead] & mask], 1);
        }
    }
    return out;
}

void measure_faces(const Surface &surface, const Welded &welded, Face *faces, std::size_t first,
                   std::size_t last) {
    Block block{};
    for (std::size_t at = first; at < last; at += lanes) {
        const std::size_t some = last - at < lanes ? last - at : lanes;
        for (std::size_t i = 0; i < some; ++i)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t vertex = welded.number[surface.triangles[(at + i) * 3 + k]];
                faces[at + i].vertex[k] = vertex;
                const WeldedVertex &spot = welded.spots[vertex];
                for (std::size_t c = 0; c < 3; ++c) {
                    block.in[k][c][i] = spot.position[c];
                    block.in[k][3 + c][i] = spot.normal[c];
                }
                block.in[k][6][i] = spot.uv[0];
                block.in[k][7][i] = spot.uv[1];
            }
        measure(block);
        for (std::size_t i = 0; i < some; ++i) {
            Face &face = faces[at + i];
            face.flags = block.flags[i];
            for (std::size_t c = 0; c < 3; ++c) {
                face.down[c] = block.down[c][i];
                for (std::size_t k = 0; k < 3; ++k)
                    face.pull[k][c] = block.pull[k][c][i];
            }
        }
    }
}

} // namespace paradize::mesh
