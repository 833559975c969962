#include "passes/sky_pass.hpp"

#include <epoxy/gl.h>

#include <glm/ext/matrix_transform.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/mat3x3.hpp>

#include <optional>

namespace paradize {

namespace {

// Discs are drawn wider and dimmer than they are, so that they cover some pixels and do not burn out alone.
constexpr float sun_enlarged = 2.2F;
constexpr float sun_disc_gain = 14.0F; // on the radiance that lights a surface
constexpr float moon_disc_gain = 1.7F;
constexpr float star_light = 1.0F;
constexpr float star_turns = 1.0F; // of the stars' sphere in a flight
// Towards the pole that the stars turn about: low in the north, as seen from the tropics.
const glm::vec3 star_pole(0.0F, 0.26F, -0.966F);

} // namespace

/// A program that draws the sky, and what it reads.
struct SkyPass::Drawing {
    gl::Program program;
    EnvironmentBindings environment;
    std::optional<DaytimeSkyBindings> daytime;
    int sun, sun_disc, moon, moon_disc, star_light, star_area, star_turn;

    Drawing(const PassSetup &setup, gl::Program drawn, bool has_daytime)
        : program(std::move(drawn)), environment(setup, program), sun(program.location("u_sun")),
          sun_disc(program.location("u_sun_disc")), moon(program.location("u_moon")),
          moon_disc(program.location("u_moon_disc")), star_light(program.location("u_star_light")),
          star_area(program.location("u_star_area")), star_turn(program.location("u_star_turn")) {
        if (has_daytime) {
            daytime.emplace(program);
        }
    }
};

SkyPass::SkyPass(const PassSetup &setup) {
    const gl::ShaderLibrary &shaders = setup.shaders;
    if (setup.scene.file().daytime.empty()) {
        standing_ = std::make_unique<Drawing>(setup, gl::Program(shaders, "sky.vert", "sky.frag"), false);
        return;
    }
    by_day_ = std::make_unique<Drawing>(setup, gl::Program(shaders, "sky.vert", "daytime_sky.frag"), true);
    by_night_ = std::make_unique<Drawing>(
        setup, gl::Program(shaders, "sky.vert", "daytime_sky.frag", {"NIGHT 1"}), true);
}

SkyPass::~SkyPass() = default;

void SkyPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    const Daylight &light = frame.daylight;
    const Drawing &drawing = standing_ ? *standing_ : *(light.night > 0.0F ? by_night_ : by_day_);
    drawing.program.use();
    drawing.environment.apply(frame, view);
    if (drawing.daytime) {
        const assets::SceneFile &file = frame.scene.file();
        drawing.daytime->apply(frame.scene, light);
        gl::Program::set(drawing.sun, light.sun.direction);
        gl::Program::set(drawing.sun_disc, glm::vec4(sun_disc_gain * light.sun.radiance,
                                                     sun_enlarged * 0.5F * file.sun.angular_diameter_rad));
        gl::Program::set(drawing.moon, light.moon.direction);
        gl::Program::set(drawing.moon_disc,
                         glm::vec4(moon_disc_gain * light.moon.radiance, 0.5F * file.moon_diameter_rad));
        gl::Program::set(drawing.star_light, star_light * light.night * light.night);
        // A star is as wide as a pixel: where that is enlarged, the same light has a larger area.
        gl::Program::set(drawing.star_area, frame.settings.render_scale * frame.settings.render_scale);
        const auto turn = static_cast<float>(frame.clock.flight_s / file.flight.duration_s);
        gl::Program::set(
            drawing.star_turn,
            glm::mat3(glm::rotate(glm::mat4(1.0F), star_turns * turn * glm::two_pi<float>(), star_pole)));
    }
    glDepthMask(GL_FALSE); // it is drawn at the far plane
    glDisable(GL_CULL_FACE);
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
}

} // namespace paradize
