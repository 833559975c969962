#include "passes/objects_pass.hpp"

#include <epoxy/gl.h>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

namespace paradize {

namespace {

using assets::ObjectMap;

unsigned unit_of(ObjectMap map) {
    return static_cast<unsigned>(map);
}

/// Two-sided materials with holes are leaves. They transmit this share of the light from behind.
constexpr float leaf_translucency = 0.55F;

/// 0: opaque.
float cutoff_of(const assets::Material &material) {
    return material.alpha_mode == assets::AlphaMode::mask ? material.alpha_cutoff : 0.0F;
}

std::string parallax_define(const RenderSettings &settings) {
    return "PARALLAX_STEPS " + std::to_string(settings.parallax_steps);
}

void set_two_sided(bool both) {
    if (both) {
        glDisable(GL_CULL_FACE);
    } else {
        glEnable(GL_CULL_FACE);
    }
}

} // namespace

ObjectsPass::ObjectsPass(const PassSetup &setup)
    : depth_(setup.shaders, "depth.vert", "depth.frag"),
      program_(setup.shaders, "object.vert", "object.frag",
               {shadow_define(setup.settings), parallax_define(setup.settings)}),
      environment_(setup, program_), depth_model_location_(depth_.location("u_model")),
      depth_cutoff_location_(depth_.location("u_alpha_cutoff")),
      model_location_(program_.location("u_model")), base_color_location_(program_.location("u_base_color")),
      parallax_location_(program_.location("u_parallax")),
      shine_location_(program_.location("u_specular_smoothness")),
      cutoff_location_(program_.location("u_alpha_cutoff")),
      translucency_location_(program_.location("u_translucency")),
      multisampled_location_(program_.location("u_multisampled")) {
    depth_.set_unit("u_color", unit_of(ObjectMap::color));
    assets::for_each_map([&](ObjectMap map, std::string_view name) {
        program_.set_unit(("u_" + std::string(name)).c_str(), unit_of(map));
        has_map_locations_[map] = program_.location(("u_has_" + std::string(name)).c_str());
    });
    for (const Object &object : setup.scene.objects()) {
        std::vector<assets::PerMap<unsigned>> &samplers = samplers_of_.emplace_back();
        for (const Material &material : object.materials) {
            const gl::Wrap wrap = material.values.repeat ? gl::Wrap::repeat : gl::Wrap::clamp;
            assets::PerMap<unsigned> &of_material = samplers.emplace_back();
            assets::for_each_map([&](ObjectMap map, std::string_view) {
                const assets::Artifact *artifact =
                    setup.scene.file().find_artifact(material.values.maps[map]);
                const std::optional<int> max_level = artifact != nullptr ? artifact->max_level : std::nullopt;
                of_material[map] = sampler(wrap, max_level, setup.settings);
            });
        }
    }
}

unsigned ObjectsPass::sampler(gl::Wrap wrap, std::optional<int> max_level, const RenderSettings &settings) {
    for (const CachedSampler &cached : samplers_) {
        if (cached.wrap == wrap && cached.max_level == max_level) {
            return cached.sampler.name();
        }
    }
    samplers_.push_back(
        {wrap, max_level,
         gl::make_sampler(wrap, gl::Filter::mipmapped, settings.anisotropy, max_level, settings.mip_bias)});
    return samplers_.back().sampler.name();
}

std::span<const assets::PerMap<unsigned>> ObjectsPass::samplers_of(const Frame &frame,
                                                                   const Object &object) const {
    return samplers_of_[static_cast<std::size_t>(&object - frame.scene.objects().data())];
}

void ObjectsPass::draw_depth(const Frame &frame, const View &light) {
    depth_.use();
    depth_bias(true);
    for (const DrawItem &item : frame.visible(ViewKind::light)) {
        const Object &object = *item.object;
        const auto samplers = samplers_of(frame, object);
        gl::Program::set(depth_model_location_, light.local(item.instance->model));
        glFrontFace(item.instance->mirrored == light.mirrored ? GL_CCW : GL_CW);
        for (std::size_t m = 0; m < object.materials.size(); ++m) {
            const Material &material = object.materials[m];
            const StreamedTexture *color = material.maps[ObjectMap::color];
            if (color != nullptr) {
                color->bind(unit_of(ObjectMap::color), samplers[m][ObjectMap::color]);
            }
            set_two_sided(material.values.two_sided);
            gl::Program::set(depth_cutoff_location_, color != nullptr ? cutoff_of(material.values) : 0.0F);
            object.mesh->draw(item.lod, static_cast<int>(m));
        }
    }
    set_two_sided(false);
    glFrontFace(light.mirrored ? GL_CW : GL_CCW);
    depth_bias(false);
}

void ObjectsPass::draw(const Frame &frame, const View &view) {
    if (view.kind == ViewKind::light) {
        draw_depth(frame, view);
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    const bool multisampled = view.kind == ViewKind::main && frame.settings.samples > 1;
    gl::Program::set(multisampled_location_, multisampled ? 1.0F : 0.0F);
    if (multisampled) {
        glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
    for (const DrawItem &item : frame.visible(view.kind)) {
        const Object &object = *item.object;
        const auto samplers = samplers_of(frame, object);
        gl::Program::set(model_location_, view.local(item.instance->model));
        glFrontFace(item.instance->mirrored == view.mirrored ? GL_CCW : GL_CW);
        for (std::size_t m = 0; m < object.materials.size(); ++m) {
            const Material &material = object.materials[m];
            assets::for_each_map([&](ObjectMap map, std::string_view) {
                if (material.maps[map] != nullptr) {
                    material.maps[map]->bind(unit_of(map), samplers[m][map]);
                }
                gl::Program::set(has_map_locations_[map], material.maps[map] != nullptr ? 1.0F : 0.0F);
            });
            const assets::Material &values = material.values;
            const float cutoff = cutoff_of(values);
            set_two_sided(values.two_sided);
            gl::Program::set(base_color_location_, values.color);
            gl::Program::set(parallax_location_, parallax_of(values));
            gl::Program::set(shine_location_, glm::vec2(values.specular, values.smoothness));
            gl::Program::set(cutoff_location_, cutoff);
            gl::Program::set(translucency_location_,
                             values.two_sided && cutoff > 0.0F ? leaf_translucency : 0.0F);
            object.mesh->draw(item.lod, static_cast<int>(m));
        }
    }
    set_two_sided(false);
    glFrontFace(view.mirrored ? GL_CW : GL_CCW);
    if (multisampled) {
        glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
}

} // namespace paradize
