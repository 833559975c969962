#include "scene/point_lights.hpp"

#include "scene/turn.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace paradize {

namespace {

/// Three waves whose periods have no common multiple make a flame that is never seen to repeat.
constexpr std::array<double, 3> flickers_per_s{1.31, 3.07, 7.43};
constexpr std::array<double, 3> flicker_shares{0.5, 0.3, 0.2};

/// Seconds from `from` to `to` around the loop of the flight, in [0, duration).
double later(double from, double to, double duration_s) {
    const double seconds = std::fmod(to - from, duration_s);
    return seconds < 0.0 ? seconds + duration_s : seconds;
}

double fade_share(double seconds, double fade_s) {
    return fade_s > 0.0 ? glm::smoothstep(0.0, fade_s, seconds) : (seconds >= 0.0 ? 1.0 : 0.0);
}

} // namespace

float light_strength(const assets::PointLight &light, std::size_t number, const Moment &moment,
                     double duration_s) {
    double strength = 1.0;
    if (!light.always) {
        const double lit_s = later(light.on_s, light.off_s, duration_s);
        const double since_s = later(light.on_s, moment.flight_s, duration_s);
        const auto fade_s = static_cast<double>(light.fade_s);
        strength =
            fade_share(since_s, fade_s) * (since_s < lit_s ? 1.0 : 1.0 - fade_share(since_s - lit_s, fade_s));
    }
    if (light.flicker > 0.0F && strength > 0.0) {
        double wave = 0.0;
        for (std::size_t k = 0; k < flickers_per_s.size(); ++k) {
            const double turns =
                flickers_per_s[k] * moment.elapsed_s + 0.618 * static_cast<double>(number * (k + 1));
            wave += flicker_shares[k] * std::sin(turn * (turns - std::floor(turns)));
        }
        strength *= 1.0 - static_cast<double>(light.flicker) * (0.5 + 0.5 * wave);
    }
    return static_cast<float>(strength);
}

} // namespace paradize
