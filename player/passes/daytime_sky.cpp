#include "passes/daytime_sky.hpp"

#include "gl/texture.hpp"

#include <glm/gtc/constants.hpp>

#include <cmath>

namespace paradize {

DaytimeSkyBindings::DaytimeSkyBindings(const gl::Program &program)
    : clouds_sampler_(gl::make_sampler({gl::Wrap::repeat, gl::Wrap::clamp}, gl::Filter::mipmapped)),
      share_location_(program.location("u_sky_share")), turns_location_(program.location("u_sky_turns")),
      fit_location_(program.location("u_clouds_fit")), ambient_location_(program.location("u_cloud_ambient")),
      direction_location_(program.location("u_light_direction")),
      radiance_location_(program.location("u_light_radiance")) {
    program.set_unit("u_sky_before", unit_before);
    program.set_unit("u_sky_after", unit_after);
    program.set_unit("u_clouds", unit_clouds);
}

void DaytimeSkyBindings::apply(const Scene &scene, const Daylight &daylight) const {
    const assets::SceneFile &file = scene.file();
    const SkyBlend &sky = daylight.sky;
    scene.texture(file.daytime[sky.key[0]].sky)->bind(unit_before);
    scene.texture(file.daytime[sky.key[1]].sky)->bind(unit_after);
    gl::Program::set(share_location_, sky.share);
    gl::Program::set(turns_location_, glm::vec4(std::cos(sky.turn_rad[0]), std::sin(sky.turn_rad[0]),
                                                std::cos(sky.turn_rad[1]), std::sin(sky.turn_rad[1])));
    glm::vec4 fit(0.0F);
    if (file.clouds) {
        const StreamedTexture *map = scene.texture(file.clouds->map);
        map->bind(unit_clouds, clouds_sampler_.name());
        const float widths_per_rad = static_cast<float>(file.clouds->repeat) / glm::two_pi<float>();
        const float texels_per_rad = static_cast<float>(map->width_px()) * widths_per_rad;
        fit = glm::vec4(widths_per_rad, daylight.clouds_turn_rad * widths_per_rad,
                        1.0F / file.clouds->high_rad, map->resident() ? texels_per_rad : 0.0F);
    }
    gl::Program::set(fit_location_, fit);
    gl::Program::set(ambient_location_, daylight.ambient);
    gl::Program::set(direction_location_, daylight.brighter().direction);
    gl::Program::set(radiance_location_, daylight.brighter().radiance);
}

} // namespace paradize
