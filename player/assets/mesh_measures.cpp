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

template <typename Vector>
Vector read(std::span<const std::byte> bytes, const GlbFormat &format, std::uint32_t vertex) {
    const std::size_t component_bytes = format.component == float_type ? 4 : 2;
    Vector out;
    for (int i = 0; i < Vector::length(); ++i) {
        out[i] = component_at(bytes.data() + std::size_t{vertex} * format.stride +
                                  static_cast<std::size_t>(i) * component_bytes,
                              format);
    }
    return out;
}

/// The triangles of one material.
struct Measured {
    glm::vec3 low{std::numeric_limits<float>::max()};
    glm::vec3 high{std::numeric_limits<float>::lowest()};
    // texture coordinates per metre, area; of the first and the second ones
    std::array<std::vector<std::pair<float, float>>, 2> densities;
    double area = 0.0;
};

void add_triangle(const Glb &glb, const GlbLevel &level, const std::array<std::uint32_t, 3> &corners,
                  Measured &out) {
    std::array<glm::vec3, 3> places;
    for (std::size_t i = 0; i < 3; ++i) {
        places[i] = read<glm::vec3>(level.positions, level.formats[0], corners[i]);
        out.low = glm::min(out.low, places[i]);
        out.high = glm::max(out.high, places[i]);
    }
    const float step = glb.grid.step[0]; // the same along all axes
    const float area = step * step * glm::length(glm::cross(places[1] - places[0], places[2] - places[0]));
    if (!(area > 0.0F)) {
        return;
    }
    out.area += static_cast<double>(area);
    const std::array sets{level.uvs, level.uvs1};
    for (std::size_t set = 0; set < sets.size(); ++set) {
        if (sets[set].empty()) {
            continue;
        }
        std::array<glm::vec2, 3> uvs{};
        for (std::size_t i = 0; i < 3; ++i) {
            uvs[i] = read<glm::vec2>(sets[set], level.formats[3 + set], corners[i]);
        }
        const glm::vec2 a = uvs[1] - uvs[0];
        const glm::vec2 b = uvs[2] - uvs[0];
        out.densities[set].emplace_back(std::sqrt(std::abs(a.x * b.y - a.y * b.x) / area), area);
    }
}

float stretched_density(Measured &measured, std::size_t set) {
    std::ranges::sort(measured.densities[set]);
    double area = 0.0;
    for (const auto &[density, triangle] : measured.densities[set]) {
        area += static_cast<double>(triangle);
        if (area >= stretched_share * measured.area) {
            return density;
        }
    }
    return 0.0F;
}

} // namespace

std::vector<MaterialMeasure> measure_materials(const Glb &glb) {
    std::vector<Measured> measured(glb.materials.size());
    const GlbLevel &level = glb.levels.back();
    for (const GlbPrimitive &primitive : level.primitives) {
        for (std::size_t i = 0; i + 2 < primitive.count; i += 3) {
            std::array<std::uint32_t, 3> corners{};
            for (std::size_t corner = 0; corner < 3; ++corner) {
                std::memcpy(&corners[corner], primitive.indices.data() + (i + corner) * level.index_bytes,
                            level.index_bytes);
            }
            add_triangle(glb, level, corners, measured[primitive.material]);
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
