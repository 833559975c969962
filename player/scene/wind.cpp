#include "scene/wind.hpp"

#include "scene/repeating.hpp"
#include "scene/turn.hpp"

#include <glm/geometric.hpp>

#include <cmath>

namespace paradize {

namespace {

// Turns per second of a plant that was bent and let go, and of its leaves: palms and grasses of a few metres.
constexpr double sways_per_s = 0.31;
constexpr double flutters_per_s = 1.7;
// Waves as in shaders/lib/wind.glsl, as multiples of the gusts': along the wind, across it.
constexpr double second_along = 1.7;
constexpr double second_across = 0.9;
constexpr double sway_along = 3.0;
constexpr glm::dvec3 flutter_wave(2.1, 1.3, 2.9); // rad/m

float phase_of(double angle) {
    const double rest = std::fmod(angle, turn);
    return static_cast<float>(rest < 0.0 ? rest + turn : rest);
}

} // namespace

WindNow wind_now(const assets::Wind &wind, double duration_s, double elapsed_s, const glm::dvec3 &anchor) {
    const double wave = turn / wind.gust_m;
    const double along = wave * (wind.direction.x * anchor.x + wind.direction.y * anchor.z);
    const double across = wave * (wind.direction.x * anchor.z - wind.direction.y * anchor.x);
    const double gusts_per_s = wind.speed_m_per_s / wind.gust_m;
    // rad that a wave of so many turns per second has moved
    const auto moved = [&](double per_s) { return turn * whole_cycles_per_s(per_s, duration_s) * elapsed_s; };
    WindNow out;
    out.direction = glm::vec4(wind.direction, static_cast<float>(wave), 0.0F);
    out.phases = {
        phase_of(along - moved(gusts_per_s)),
        phase_of(second_along * along + second_across * across - moved(1.3 * gusts_per_s)),
        phase_of(sway_along * along - moved(sways_per_s)),
        phase_of(glm::dot(flutter_wave, anchor) - moved(flutters_per_s)),
    };
    return out;
}

} // namespace paradize
