#include "scene/near_waves.hpp"

#include "scene/flight.hpp"
#include "scene/turn.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

/// length and height relative to the longest wave's length and to the height of all; bearing from that of the
/// normal map's scroll.
struct WaveShape {
    double length, height, bearing_rad;
};
constexpr std::array<WaveShape, near_wave_count> shapes{
    {{1.0, 0.40, 0.1}, {0.80, 0.28, -0.75}, {0.66, 0.20, 0.95}, {0.55, 0.12, -0.3}}};
constexpr double still_depth_m = 0.6; // up to which there are no waves: the swash runs there
constexpr double full_depth_m = 3.5;  // from which they are as high as can be

} // namespace

double wave_periods(double wave_number, double duration_s) {
    constexpr double gravity_m_per_s2 = 9.81;
    return std::max(1.0, std::round(duration_s * std::sqrt(gravity_m_per_s2 * wave_number) / turn));
}

NearWaves near_waves_at(const assets::SceneFile &file, double elapsed_s, const View &main) {
    const assets::Water &water = *file.water;
    const double duration_s = file.flight.duration_s;
    const double share = flight_second(elapsed_s, duration_s) / duration_s;
    const glm::dvec2 scroll(water.scroll_per_s);
    const double bearing = glm::dot(scroll, scroll) > 0.0 ? std::atan2(scroll.y, scroll.x) : 0.0;
    const double eye_m = std::abs(static_cast<double>(main.eye.y) + main.anchor.y - water.level_m);
    const double height_m = std::min(static_cast<double>(water.wave_height_m), eye_m);
    NearWaves out;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        const WaveShape &shape = shapes[i];
        const double length_m = shape.length * static_cast<double>(water.wave_length_m);
        const double k = turn / length_m;
        const double periods = wave_periods(k, duration_s);
        // Layer 0 of the normal map runs against its scroll.
        const double angle = bearing + glm::pi<double>() + shape.bearing_rad;
        const glm::dvec2 way(k * std::cos(angle), k * std::sin(angle));
        const double turns =
            (way.x * main.anchor.x + way.y * main.anchor.z) / turn - share * periods + 0.25 * i;
        const double phase = turn * (turns - std::floor(turns));
        out[i] = glm::vec4(way, phase, 0.5 * shape.height * height_m);
    }
    return out;
}

glm::vec2 grid_center(const assets::Water &water, const View &view) {
    const double cell_m = static_cast<double>(water.wave_length_m / cells_per_wave);
    const auto snapped = [&](double local, double anchor) {
        return static_cast<float>(std::round((local + anchor) / cell_m) * cell_m - anchor);
    };
    return {snapped(view.eye.x, view.anchor.x), snapped(view.eye.z, view.anchor.z)};
}

WaveShares wave_shares(const assets::SceneFile &file) {
    WaveShares out;
    if (!file.terrain || file.terrain->floor.highest_m.empty()) {
        return out;
    }
    const assets::TerrainFloor &floor = file.terrain->floor;
    out.columns = floor.columns;
    out.rows = floor.rows;
    out.per_m = 1.0F / (floor.cell_m * glm::vec2(floor.columns, floor.rows));
    out.corner_m = -0.5 * glm::dvec2(file.terrain->size_m);
    out.shares.clear();
    for (const float highest_m : floor.highest_m) {
        const double depth_m = static_cast<double>(file.water->level_m) - static_cast<double>(highest_m);
        out.shares.push_back(static_cast<float>(glm::smoothstep(still_depth_m, full_depth_m, depth_m)));
    }
    return out;
}

} // namespace paradize
