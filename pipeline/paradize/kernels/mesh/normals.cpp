#include "mesh/normals.hpp"

#include <algorithm>
#include <vector>

#include "math/functions.hpp"
#include "math/vec.hpp"

namespace paradize::mesh {
namespace {

// Above this many corners at one position the crease test, quadratic in them, is left out: all are smooth.
constexpr std::size_t largest_fan = 512;

double angle_between(Vec a, Vec b) {
    return mathx::atan2(length(cross(a, b)), dot(a, b));
}

} // namespace

void corner_normals(std::span<const float> positions, std::span<const std::uint32_t> places,
                    std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> smoothing,
                    double crease_deg, std::span<float> out) {
    const std::size_t count = triangles.size() / 3;
    const double crease_cos = mathx::cos(crease_deg * (mathx::pi / 180));
    std::vector<Vec> face_normal(count);
    std::vector<double> weight(count * 3);
    std::uint32_t place_count = 0;
    for (std::size_t t = 0; t < count; ++t) {
        Vec p[3];
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = at3(positions, triangles[t * 3 + k]);
            place_count = std::max(place_count, places[triangles[t * 3 + k]] + 1);
        }
        face_normal[t] = unit(cross(unit(p[1] - p[0]), unit(p[2] - p[0])));
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec a = unit(p[(k + 1) % 3] - p[k]), b = unit(p[(k + 2) % 3] - p[k]);
            weight[t * 3 + k] = angle_between(a, b);
        }
    }
    // Corners by place, in the order of the file: sums are the same on every machine.
    std::vector<std::uint32_t> start(place_count + 1, 0), corners(count * 3);
    for (const std::uint32_t v : triangles)
        ++start[places[v] + 1];
    for (std::size_t i = 1; i < start.size(); ++i)
        start[i] += start[i - 1];
    std::vector<std::uint32_t> fill(start.begin(), start.end() - 1);
    for (std::size_t c = 0; c < triangles.size(); ++c)
        corners[fill[places[triangles[c]]]++] = static_cast<std::uint32_t>(c);

    for (std::size_t place = 0; place < place_count; ++place) {
        const std::span<const std::uint32_t> here(&corners[start[place]], start[place + 1] - start[place]);
        for (const std::uint32_t c : here) {
            const std::size_t t = c / 3;
            const std::uint32_t group = smoothing[t];
            Vec sum = face_normal[t];
            if (group != 0) {
                sum = {};
                const bool crease = group == unknown_smoothing && here.size() <= largest_fan;
                for (const std::uint32_t other : here) {
                    const std::size_t u = other / 3;
                    if (smoothing[u] == group &&
                        (!crease || dot(face_normal[t], face_normal[u]) >= crease_cos))
                        sum = sum + weight[other] * face_normal[u];
                }
            }
            Vec normal = unit(sum);
            if (normal == Vec{})
                normal = face_normal[t] == Vec{} ? Vec{0, 0, 1} : face_normal[t];
            put3(out, c, normal);
        }
    }
}

} // namespace paradize::mesh
