#pragma once
// How a sound of the scene is heard: its gain and where it comes from. Depends on the pose and the second
// alone.

#include "assets/scene/file.hpp"
#include "scene/flight.hpp"

#include <glm/vec3.hpp>

namespace paradize {

struct HeardSound {
    float gain = 0.0F; // amplitude, 0 to 1; without the sound's own volume
    /// Where it comes from, in the axes of the eye: right, up, back. Length 1: from one direction; 0: from
    /// all directions alike.
    glm::vec3 direction{0.0F};
};

/// Returns how a sound is heard from `pose` at `elapsed_s` of a flight that takes `duration_s`.
///
/// The gain follows the distance d to the nearest place: 1 up to radius_m, then (radius_m / d)^falloff. The
/// direction is the energy vector: the mean direction to all places, each weighted with the power that
/// arrives from it, 1 / d^2. M. A. Gerzon, "General Metatheory of Auditory Localisation", 92nd AES
/// Convention, 1992. Along a line the means are integrals in closed form.
HeardSound hear(const assets::Sound &sound, const Pose &pose, double elapsed_s, double duration_s);

/// Returns the gain of the hours of a sound, 0 to 1.
float gain_of_hours(const assets::SoundHours &hours, double elapsed_s, double duration_s);

} // namespace paradize
