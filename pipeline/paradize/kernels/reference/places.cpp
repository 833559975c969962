#include "reference/places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "math/functions.hpp"
#include "reference/samples.hpp"
#include "reference/uv_tree.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t least_samples = 4;
constexpr std::size_t place_chunk = 256;
constexpr double farthest_squared = std::numeric_limits<double>::max();

Point unit_or(const Point &v, const Point &otherwise) {
    const double length = std::sqrt(dot(v, v));
    return length > 1e-12 ? Point{v[0] / length, v[1] / length, v[2] / length} : otherwise;
}

// Weights of a triangle's corners at the point of it that is nearest to p: the foot on the plane, else the
// nearest foot on a side.
std::array<double, 3> weights_at(const Point &p, const Corners &c) {
    const Point a = minus(c[1], c[0]), b = minus(c[2], c[0]), w = minus(p, c[0]);
    const double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), wa = dot(w, a), wb = dot(w, b);
    const double det = aa * bb - ab * ab;
    const double u = bb * wa - ab * wb, v = aa * wb - ab * wa;
    if (det > 1e-20 * aa * bb && u >= 0 && v >= 0 && u + v <= det)
        return {1 - (u + v) / det, u / det, v / det};
    std::array<double, 3> best{1, 0, 0};
    double least = farthest_squared;
    for (std::size_t k = 0; k < 3; ++k) {
        const Point d = minus(c[(k + 1) % 3], c[k]), from = minus(p, c[k]);
        const double l = dot(d, d);
        const double s = l > 0 ? std::clamp(dot(from, d) / l, 0.0, 1.0) : 0;
        const Point r = minus(from, {s * d[0], s * d[1], s * d[2]});
        if (dot(r, r) < least) {
            least = dot(r, r);
            best = {0, 0, 0};
            best[k] = 1 - s;
            best[(k + 1) % 3] += s;
        }
    }
    return best;
}

// A row of `width` numbers per vertex, mixed at a place.
template <std::size_t width>
std::array<double, width> mixed(std::span<const float> rows, const Shading &shading, std::size_t triangle,
                                const std::array<double, 3> &weights) {
    std::array<double, width> out{};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < width; ++i)
            out[i] += weights[k] * rows[shading.triangles[triangle * 3 + k] * width + i];
    return out;
}

// Whole part of x, and of x less whole turns of n; x within 2^31.
std::int64_t below(double x) {
    const auto whole = static_cast<std::int64_t>(x);
    return whole - (static_cast<double>(whole) > x ? 1 : 0);
}

// The texel, 0 to n - 1, that is read for i.
std::int64_t texel_within(std::int64_t i, std::int64_t n, Wrap wrap) {
    if (i >= 0 && i < n)
        return i;
    if (wrap == Wrap::clamp)
        return std::clamp<std::int64_t>(i, 0, n - 1);
    if (wrap == Wrap::repeat)
        return (i % n + n) % n;
    const std::int64_t turned = (i % (2 * n) + 2 * n) % (2 * n);
    return std::min(turned, 2 * n - 1 - turned);
}

Point sampled(const NormalMap &map, double u, double v) {
    const auto texels = [&](double share, std::size_t count, Wrap wrap) {
        const auto n = static_cast<std::int64_t>(count);
        // Texture coordinates beyond 2^31 say nothing any more.
        const double x = std::clamp(share * static_cast<double>(count) - 0.5, -0x1p31, 0x1p31);
        const std::int64_t low = below(x);
        std::array<std::size_t, 2> at;
        for (std::int64_t k = 0; k < 2; ++k) {
            at[static_cast<std::size_t>(k)] = static_cast<std::size_t>(texel_within(low + k, n, wrap));
        }
        return std::pair(at, x - static_cast<double>(low));
    };
    const auto [columns, right] = texels(u, map.columns, map.across);
    const auto [rows, down] = texels(v, map.rows, map.down);
    Point out{};
    for (std::size_t j = 0; j < 2; ++j)
        for (std::size_t i = 0; i < 2; ++i) {
            const double weight = (i ? right : 1 - right) * (j ? down : 1 - down);
            const float *texel = &map.vectors[(rows[j] * map.columns + columns[i]) * 3];
            for (std::size_t k = 0; k < 3; ++k)
                out[k] += weight * texel[k];
        }
    return unit_or(out, {0, 0, 1});
}

Point normal_of(const Corners &c) {
    return cross(minus(c[1], c[0]), minus(c[2], c[0]));
}

// The normal that a surface shows at a place of one of its triangles, without and with the map.
struct Shown {
    Point plain, mapped;
};

Shown shown(const Surface &surface, const Shading &shading, const NormalMap &map, std::size_t triangle,
            const std::array<double, 3> &weights) {
    const Point n = unit_or(mixed<3>(shading.normals, shading, triangle, weights),
                            unit_or(normal_of(corners_of(surface, triangle)), {0, 1, 0}));
    if (map.rows == 0)
        return {n, n};
    const auto tangent = mixed<4>(shading.tangents, shading, triangle, weights);
    const Point t = unit_or({tangent[0], tangent[1], tangent[2]}, {1, 0, 0});
    Point b = cross(n, t);
    if (tangent[3] < 0)
        b = {-b[0], -b[1], -b[2]};
    const auto uv = mixed<2>(shading.uvs, shading, triangle, weights);
    const Point m = sampled(map, uv[0], uv[1]);
    return {n, unit_or(along(along({m[2] * n[0], m[2] * n[1], m[2] * n[2]}, m[0], t), m[1], b), n)};
}

double degrees(const Point &a, const Point &b) {
    const Point c = cross(a, b);
    return mathx::atan2(std::sqrt(dot(c, c)), dot(a, b)) * (180 / mathx::pi);
}

Spread spread_of(const std::vector<double> &values, const Shares &shares) {
    Spread out;
    std::vector<std::uint32_t> owner(values.size());
    double sum = 0, area = 0;
    for (std::size_t i = 0; i < shares.weight.size(); ++i)
        for (std::size_t k = shares.first[i]; k < shares.first[i + 1]; ++k) {
            sum += values[k] * shares.weight[i];
            area += shares.weight[i];
            owner[k] = static_cast<std::uint32_t>(i);
            out.max = std::max(out.max, values[k]);
        }
    out.mean = area > 0 ? sum / area : 0;
    out.p99 = quantile(values, 0.99, [&](std::size_t k) { return shares.weight[owner[k]]; });
    return out;
}

} // namespace

Angles normal_angles(const Tree &from, const Shading &seen, const Tree &to, const Shading &truth,
                     const NormalMap &map, double near, std::uint64_t samples, unsigned threads) {
    const Surface &surface = from.surface();
    const std::size_t count = surface.triangles.size() / 3;
    const Shares shares(surface, samples, least_samples);
    std::vector<double> plain(shares.first.back());
    const bool mapped = map.rows > 0 && !seen.tangents.empty() && !seen.uvs.empty() &&
                        !truth.tangents.empty() && !truth.uvs.empty();
    const NormalMap used = mapped ? map : NormalMap{};
    std::vector<double> turned_too(mapped ? plain.size() : 0);
    // Samples of neighbouring triangles share a packet; the few whose nearest place faces away look again,
    // with those of their own triangle.
    struct Sample {
        std::size_t triangle, place;
        std::array<double, 3> weights;
        Point p;
    };
    for_chunks((count + place_chunk - 1) / place_chunk, threads, [&](std::size_t chunk) {
        std::vector<std::pair<double, double>> uvs;
        std::array<Sample, Packet::size> held;
        std::size_t filled = 0;
        double hint = -1;
        const auto compare = [&](const Sample &sample, double slot) {
            const std::size_t there = to.triangle(slot);
            const Shown here = shown(surface, seen, used, sample.triangle, sample.weights),
                        other = shown(to.surface(), truth, used, there,
                                      weights_at(sample.p, corners_of(to.surface(), there)));
            plain[sample.place] = degrees(here.plain, other.plain);
            if (mapped)
                turned_too[sample.place] = degrees(here.mapped, other.mapped);
        };
        const auto flush = [&] {
            Packet packet;
            for (std::size_t k = 0; k < Packet::size; ++k) {
                const Point &p = held[std::min(k, filled - 1)].p;
                packet.x[k] = p[0];
                packet.y[k] = p[1];
                packet.z[k] = p[2];
            }
            packet.best.fill(farthest_squared);
            packet.slot.fill(-1);
            to.nearest(packet, hint, nullptr);
            hint = packet.slot[0];
            for (std::size_t start = 0, stop = 0; start < filled; start = stop) {
                const std::size_t i = held[start].triangle;
                const Point normal = normal_of(corners_of(surface, i));
                bool turned = false;
                for (stop = start; stop < filled && held[stop].triangle == i; ++stop) {
                    const std::size_t there = to.triangle(packet.slot[stop]);
                    turned = turned || !(dot(normal_of(corners_of(to.surface(), there)), normal) > 0);
                }
                Packet facing;
                if (turned) {
                    for (std::size_t k = 0; k < Packet::size; ++k) {
                        const std::size_t of = std::min(start + k, stop - 1);
                        const double reach = 2 * std::sqrt(packet.best[of]) + near;
                        facing.x[k] = packet.x[of];
                        facing.y[k] = packet.y[of];
                        facing.z[k] = packet.z[of];
                        facing.best[k] = reach * reach;
                        facing.slot[k] = -1;
                    }
                    to.nearest(facing, hint, &normal);
                }
                for (std::size_t k = start; k < stop; ++k) {
                    const bool found = turned && facing.slot[k - start] >= 0;
                    compare(held[k], found ? facing.slot[k - start] : packet.slot[k]);
                }
            }
            filled = 0;
        };
        for (std::size_t s = chunk * place_chunk; s < std::min(count, (chunk + 1) * place_chunk); ++s) {
            const std::size_t i = from.order()[s];
            const Corners c = corners_of(surface, i);
            spots(shares.count(i), uvs);
            for (std::size_t k = 0; k < uvs.size(); ++k) {
                const auto [u, v] = uvs[k];
                held[filled++] = {i, shares.first[i] + k, {1 - u - v, u, v}, at(c, uvs[k])};
                if (filled == Packet::size)
                    flush();
            }
        }
        if (filled > 0)
            flush();
    });
    Angles out{spread_of(plain, shares), {}};
    out.mapped = mapped ? spread_of(turned_too, shares) : out.plain;
    return out;
}

Spread uv_shift(const Tree &from, const Shading &seen, const Tree &to, const Shading &truth, double unit,
                std::uint64_t samples, unsigned threads) {
    const Surface &surface = from.surface();
    const UvTree tree(to, truth.triangles, truth.uvs);
    const std::size_t count = surface.triangles.size() / 3;
    const Shares shares(surface, samples, 1);
    // Where there are more triangles than samples, every so many-th is looked at.
    const std::size_t stride = std::max<std::size_t>(1, count / std::max<std::uint64_t>(1, samples));
    std::vector<double> shifts(shares.first.back(), -1);
    for_chunks((count + place_chunk - 1) / place_chunk, threads, [&](std::size_t chunk) {
        std::vector<std::pair<double, double>> uvs;
        std::vector<UvTree::Entry> open;
        for (std::size_t s = chunk * place_chunk; s < std::min(count, (chunk + 1) * place_chunk); ++s) {
            if (s % stride != 0)
                continue;
            const std::size_t i = from.order()[s];
            const Corners c = corners_of(surface, i);
            spots(shares.count(i), uvs);
            for (std::size_t k = 0; k < uvs.size(); ++k) {
                const Point p = at(c, uvs[k]);
                const auto [u, v] = uvs[k];
                const auto uv = mixed<2>(seen.uvs, seen, i, {1 - u - v, u, v});
                double best = farthest_squared;
                tree.search(
                    p, uv, unit, best, open, [&](const Corners &there, const std::array<Uv, 3> &shows) {
                        Corners image{};
                        for (std::size_t j = 0; j < 3; ++j)
                            image[j] = {shows[j][0], shows[j][1], 0};
                        const Point looked{uv[0], uv[1], 0};
                        // The place that shows the same texel, or, as in palettes, where many do or nearly
                        // so, the nearest place with what it shows beside.
                        for (const auto &weights : {weights_at(looked, image), weights_at(p, there)}) {
                            Point miss = looked, off = p;
                            for (std::size_t j = 0; j < 3; ++j) {
                                miss = along(miss, -weights[j], image[j]);
                                off = along(off, -weights[j], there[j]);
                            }
                            best =
                                std::min(best, std::sqrt(dot(off, off)) + unit * std::sqrt(dot(miss, miss)));
                        }
                    });
                shifts[shares.first[i] + k] = best;
            }
        }
    });
    Spread out;
    std::vector<double> found, weights;
    double sum = 0, area = 0;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = shares.first[i]; k < shares.first[i + 1]; ++k) {
            if (shifts[k] < 0)
                continue;
            found.push_back(shifts[k]);
            weights.push_back(shares.weight[i]);
            sum += shifts[k] * shares.weight[i];
            area += shares.weight[i];
            out.max = std::max(out.max, shifts[k]);
        }
    out.mean = area > 0 ? sum / area : 0;
    out.p99 = quantile(found, 0.99, [&](std::size_t k) { return weights[k]; });
    return out;
}

} // namespace paradize::reference
