#include "assets/mesh_measures.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace paradize::assets {

namespace {

constexpr std::uint32_t float_type = 5126;
constexpr double stretched_share = 0.05;

float component_at(const std::byte *at, const GlbFormat &format) {
    if (format.component == float_type) {
        float value = 0.0F;
        std::memcpy(&value, at, sizeof value);
        return value;
    }
    std::uint16_t code = 0; // all else that positions and texture coordinates may have
    std::memcpy(&code, at, sizeof code);
    return format.normalized ? static_cast<float>(code) / 65535.0F : static_cast<float>(code);
}

/// The vectors of all vertices; empty where the mesh has none.
template <typename Vector>
std::vector<Vector> read_all(std::span<const std::byte> bytes, const GlbFormat &format) {
    std::vector<Vector> out(bytes.empty() ? 0 : bytes.size() / format.stride);
    const std::size_t component_bytes = format.component == float_type ? 4 : 2;
    for (std::size_t vertex = 0; vertex < out.size(); ++vertex) {
        for (int i = 0; i < Vector::length(); ++i) {
            out[vertex][i] = component_at(bytes.data() + vertex * format.stride +
                                              static_cast<std::size_t>(i) * component_bytes,
                                          format);
        }
    }
    return out;
}

struct Vertices {
    std::vector<glm::vec3> places;
    std::array<std::vector<glm::vec2>, 2> uvs;
};

/// The triangles of one material.
struct Measured {
    glm::vec3 low{std::numeric_limits<float>::max()};
    glm::vec3 high{std::numeric_limits<float>::lowest()};
    // square of the texture coordinates per metre, area; of the first and the second ones
    std::array<std::vector<std::pair<float, float>>, 2> densities;
    double area = 0.0;
};

void add_triangle(const Vertices &vertices, float step, const std::array<std::uint32_t, 3> &corners,
                  Measured &out) {
    std::array<glm::vec3, 3> places;
    for (std::size_t i = 0; i < 3; ++i) {
        places[i] = vertices.places[corners[i]];
        out.low = glm::min(out.low, places[i]);
        out.high = glm::max(out.high, places[i]);
    }
    const float area = step * step * glm::length(glm::cross(places[1] - places[0], places[2] - places[0]));
    if (!(area > 0.0F)) {
        return;
    }
    out.area += static_cast<double>(area);
    for (std::size_t set = 0; set < vertices.uvs.size(); ++set) {
        const std::vector<glm::vec2> &uvs = vertices.uvs[set];
        if (uvs.empty()) {
            continue;
        }
        const glm::vec2 a = uvs[corners[1]] - uvs[corners[0]];
        const glm::vec2 b = uvs[corners[2]] - uvs[corners[0]];
        out.densities[set].emplace_back(std::abs(a.x * b.y - a.y * b.x) / area, area);
    }
}

/// The density that triangles with a share of the area do not exceed: a search that halves what is left, not
/// a sort of all triangles.
float stretched_density(Measured &measured, std::size_t set) {
    std::span<std::pair<float, float>> left = measured.densities[set];
    double wanted = stretched_share * measured.area;
    while (left.size() > 1) {
        const auto half = static_cast<std::ptrdiff_t>(left.size() / 2);
        std::ranges::nth_element(left, left.begin() + half);
        double area = 0.0;
        for (const auto &[density, triangle] : left.first(left.size() / 2)) {
            area += static_cast<double>(triangle);
        }
        const bool reached = area >= wanted;
        wanted -= reached ? 0.0 : area;
        left = reached ? left.first(left.size() / 2) : left.subspan(left.size() / 2);
    }
    return left.empty() ? 0.0F : std::sqrt(left.front().first);
}

} // namespace

std::vector<MaterialMeasure> measure_materials(const Glb &glb) {
    std::vector<Measured> measured(glb.materials.size());
    const GlbLevel &level = glb.levels.back();
    const Vertices vertices{read_all<glm::vec3>(level.positions, level.formats[0]),
                            {read_all<glm::vec2>(level.uvs, level.formats[3]),
                             read_all<glm::vec2>(level.uvs1, level.formats[4])}};
    for (const GlbPrimitive &primitive : level.primitives) {
        for (std::size_t i = 0; i + 2 < primitive.count; i += 3) {
            std::array<std::uint32_t, 3> corners{};
            for (std::size_t corner = 0; corner < 3; ++corner) {
                std::memcpy(&corners[corner], primitive.indices.data() + (i + corner) * level.index_bytes,
                            level.index_bytes);
            }
            add_triangle(vertices, glb.grid.step[0], corners, measured[primitive.material]);
        }
    }
    std::vector<MaterialMeasure> out;
    for (Measured &one : measured) {
        MaterialMeasure &measure = out.emplace_back();
        if (one.low.x <= one.high.x) {
            measure.center = 0.5F * one.low + 0.5F * one.high;
            measure.uv_per_m = stretched_density(one, 0);
            measure.second_uv_per_m = stretched_density(one, 1);
        }
    }
    return out;
}

} // namespace paradize::assets
