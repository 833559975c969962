#include "scene/motion.hpp"

#include "scene/turn.hpp"

#include <glm/common.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

constexpr double golden = 0.6180339887498949; // of a round, between neighbours in the list
constexpr double ramp = 0.08;                 // of the time between two glides: wings come to rest

/// Rounds travelled after `rounds` of time: stands still, then catches up, at each pause.
double travelled(const assets::Motion &motion, double rounds) {
    if (motion.pauses == 0) {
        return rounds;
    }
    const double legs = rounds * motion.pauses;
    const double share = (glm::fract(legs) - motion.pause_share) / (1.0 - motion.pause_share);
    return (std::floor(legs) + glm::smoothstep(0.0, 1.0, share)) / motion.pauses;
}

/// How far wings beat at a moment, 0 in a glide to 1.
double strength(const assets::Beat &beat, double rounds) {
    if (beat.glides == 0) {
        return 1.0;
    }
    const double share = glm::fract(rounds * beat.glides);
    return std::max(glm::smoothstep(0.0, 1.0, 1.0 - share / ramp),
                    glm::smoothstep(0.0, 1.0, (share - beat.glide_share) / ramp));
}

} // namespace

double reach_of(const assets::Motion &motion) {
    return std::max(motion.radius_m.x, motion.radius_m.y) + motion.rise_m;
}

Moved moved_at(const assets::Motion &motion, const assets::Placement &placement, std::uint32_t number,
               double share) {
    const double rounds = motion.laps * share + glm::fract(number * golden);
    const double way = glm::fract(travelled(motion, rounds));
    const double angle = turn * way;
    const double cosine = std::cos(angle);
    const double sine = std::sin(angle);
    const glm::dvec3 local(motion.radius_m.x * cosine, motion.rise_m * std::sin(2.0 * angle),
                           motion.radius_m.y * sine);
    const double sign = motion.laps < 0 ? -1.0 : 1.0;
    glm::dquat heading(1.0, 0.0, 0.0, 0.0);
    if (motion.ahead) {
        const double yaw = std::atan2(-sign * motion.radius_m.x * sine, sign * motion.radius_m.y * cosine);
        heading = glm::angleAxis(yaw, glm::dvec3(0.0, 1.0, 0.0));
    }
    heading = heading * glm::angleAxis(sign * motion.bank_rad, glm::dvec3(0.0, 0.0, 1.0));
    Moved out;
    out.stand = glm::translate(glm::dmat4(1.0), placement.position + placement.rotation * local);
    out.stand = glm::scale(out.stand * glm::mat4_cast(placement.rotation * heading), placement.scale);
    const double now = strength(motion.beat, rounds);
    out.beat = {static_cast<float>(turn * glm::fract(way * motion.beat.per_lap)),
                static_cast<float>(now * motion.beat.lift_rad),
                static_cast<float>(now * motion.beat.swing_rad), 0.0F};
    return out;
}

} // namespace paradize
