#include "scene/ripples.hpp"

#include "scene/flight.hpp"
#include "scene/near_waves.hpp"
#include "scene/turn.hpp"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace paradize {

namespace {

// As in shaders/lib/ripples.glsl.
constexpr double length_m = 0.6;
constexpr float seen_m = 15.0F;
constexpr float reach_m = 4.0F;

constexpr double swell_s = 7.0; // about, between two times at which a circle's ripples are highest

} // namespace

Ripples ripples_at(const assets::SceneFile &file, double elapsed_s, const View &view) {
    Ripples out;
    const assets::Water &water = *file.water;
    if (water.ripples.empty()) {
        return out;
    }
    const double duration_s = file.flight.duration_s;
    const double share = flight_second(elapsed_s, duration_s) / duration_s;
    const double k = turn / length_m;
    const double periods = wave_periods(k, duration_s);
    const double turns = share * periods;
    out.phase = static_cast<float>(turn * (turns - std::floor(turns)));
    const double slope = 0.5 * k * static_cast<double>(water.ripple_height_m);
    const auto level_m = static_cast<float>(water.level_m - view.anchor.y);
    std::array<float, most_rings> away_m{};
    for (std::size_t i = 0; i < water.ripples.size(); ++i) {
        const assets::RippleCircle &circle = water.ripples[i];
        const glm::vec2 middle(static_cast<float>(circle.x_m - view.anchor.x),
                               static_cast<float>(circle.z_m - view.anchor.z));
        const float radius_m = circle.radius_m;
        const float distance_m = glm::distance(middle, glm::vec2(view.eye.x, view.eye.z)) - radius_m;
        if (distance_m > seen_m || !view.sees({middle.x, level_m, middle.y}, radius_m + reach_m)) {
            continue;
        }
        // Sorted by distance; the farthest falls out.
        auto at = static_cast<std::size_t>(out.count);
        if (out.count == most_rings) {
            if (distance_m >= away_m.back()) {
                continue;
            }
            --at;
        } else {
            ++out.count;
        }
        for (; at > 0 && away_m[at - 1] > distance_m; --at) {
            away_m[at] = away_m[at - 1];
            out.rings[at] = out.rings[at - 1];
        }
        away_m[at] = distance_m;
        const double swells = std::max(1.0, std::round(duration_s / swell_s)) + static_cast<double>(i % 5);
        const double swell =
            0.65 + 0.35 * std::sin(turn * (share * swells + 0.381966 * static_cast<double>(i)));
        out.rings[at] = glm::vec4(middle, radius_m, slope * swell);
    }
    // The farthest of a full list fades out before another takes its place.
    if (out.count == most_rings) {
        const float last_m = away_m.back();
        for (std::size_t i = 0; i < away_m.size(); ++i) {
            out.rings[i].w *= std::clamp((last_m - away_m[i]) / 2.0F, 0.0F, 1.0F);
        }
    }
    return out;
}

} // namespace paradize
