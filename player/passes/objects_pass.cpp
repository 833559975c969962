#include "passes/objects_pass.hpp"

#include "gl/buffer.hpp"
#include "passes/frame.hpp"

#include <epoxy/gl.h>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <string>

namespace paradize {

namespace {

using assets::AlphaMode;
using assets::ObjectMap;

/// The units of a pass end where the shared ones begin; more follow after those.
constexpr unsigned unit_of(ObjectMap map) {
    const auto index = static_cast<unsigned>(map);
    return index < unit_sky ? index : index - unit_sky + first_free_unit;
}
static_assert(unit_of(static_cast<ObjectMap>(assets::object_map_names.size() - 1)) < 16); // every device has
static_assert(assets::object_map_names.size() <= std::tuple_size_v<decltype(gl::MaterialUniforms::has_map)>);

gl::Wrap wrap_of(assets::Wrap wrap) {
    switch (wrap) {
    case assets::Wrap::repeat:
        return gl::Wrap::repeat;
    case assets::Wrap::clamp:
        return gl::Wrap::clamp;
    case assets::Wrap::mirror:
        break;
    }
    return gl::Wrap::mirror;
}

std::string define(std::string_view name, int value) {
    return std::string(name) + " " + std::to_string(value);
}

/// One text of all defines, without the first #define.
std::string joined(std::initializer_list<std::string> defines) {
    std::string out;
    for (const std::string &one : defines) {
        out += (out.empty() ? "" : "\n#define ") + one;
    }
    return out;
}

std::string vertex_defines(const assets::Material &material, bool colors) {
    const int tinted = material.unlit ? 2 : 1;
    return joined({define("INSTANCED", 1), define("ALPHA_MODE", static_cast<int>(material.alpha_mode)),
                   define("VERTEX_COLORS", colors && material.vertex_colors ? tinted : 0),
                   define("SWAY", material.sways() ? 1 : 0), define("BEAT", material.beats ? 1 : 0)});
}

std::string depth_defines(const assets::Material &material) {
    return vertex_defines(material, material.alpha_mode != AlphaMode::opaque); // of colours alpha alone
}

bool has_second_map(const assets::Material &material) {
    bool has = false;
    assets::for_each_map([&](ObjectMap map, std::string_view) {
        has = has || (assets::is_second(map) && !material.maps[map].empty());
    });
    return has;
}

bool is_matte(const assets::Material &material) {
    return material.specular == 0.0F && material.metalness == 0.0F;
}

/// Whether light is found at the vertices. Not under water, and not where a map or a highlight varies between
/// them.
bool is_vertex_lit(const RenderSettings &settings, const assets::Material &material, bool dry) {
    bool has_other_map = false;
    assets::for_each_map([&](ObjectMap map, std::string_view) {
        has_other_map = has_other_map || (map != ObjectMap::color && !material.maps[map].empty());
    });
    return settings.vertex_lighting && material.vertex_lit && dry && !has_other_map && is_matte(material) &&
           material.emission == glm::vec3(0.0F);
}

/// Lookups of alpha that become coverage of a pixel's samples; 0: what is below the cutoff is left out.
int alpha_taps(const RenderSettings &settings, const assets::Material &material, bool covers) {
    if (!covers || settings.samples <= 1 || material.alpha_mode != AlphaMode::mask) {
        return 0;
    }
    return settings.fine_edges ? 4 : 1;
}

std::string lit_defines(const RenderSettings &settings, const assets::Material &material, bool dry,
                        bool point_lights, bool covers) {
    const auto has = [&](ObjectMap map) { return material.maps[map].empty() ? 0 : 1; };
    const bool has_parallax = material.parallax_scale > 0.0F && has(ObjectMap::height) != 0;
    return joined(
        {vertex_defines(material, true), shadow_define(settings), cascades_define(settings),
         define("PARALLAX_STEPS", has_parallax ? settings.parallax_steps : 0), define("DRY", dry ? 1 : 0),
         define("MATTE", is_matte(material) ? 1 : 0), point_lights_define(point_lights),
         define("ALPHA_TAPS", alpha_taps(settings, material, covers)),
         define("TRANSLUCENT", material.translucency > 0.0F ? 1 : 0),
         define("COLOR_MAP", has(ObjectMap::color)), define("NORMAL_MAP", has(ObjectMap::normal)),
         define("GLOSS_MAP", has(ObjectMap::gloss)), define("OCCLUSION_MAP", has(ObjectMap::occlusion)),
         define("EMISSION_MAP", has(ObjectMap::emission)),
         define("SECOND_UV", has_second_map(material) ? 1 : 0),
         define("VERTEX_LIT", is_vertex_lit(settings, material, dry) ? 1 : 0)});
}

std::size_t most_primitives(std::span<const Object> objects) {
    std::size_t most = 1; // of a level
    for (const Object &object : objects) {
        for (const MeshLevel &level : object.mesh->levels()) {
            most = std::max(most, level.primitives.size());
        }
    }
    return most;
}

/// Draws of a list whose ranges are single instances.
std::size_t most_draws(std::span<const Object> objects) {
    std::size_t most = 0;
    for (const Object &object : objects) {
        most += object.instances.size() * most_primitives({&object, 1});
    }
    return most;
}

/// True if `draw` goes on where the other one ends, with the same instances.
bool follows(const gl::IndirectDraw &before, const gl::IndirectDraw &draw) {
    return before.first_index + before.index_count == draw.first_index &&
           before.base_vertex == draw.base_vertex && before.first_instance == draw.first_instance &&
           before.instances == draw.instances;
}

/// Uniforms that no material has.
gl::MaterialUniforms not_written() {
    gl::MaterialUniforms out;
    out.alpha_cutoff = -1.0F;
    return out;
}

gl::MaterialUniforms uniforms_of(const Material &material) {
    const assets::Material &values = material.values;
    gl::MaterialUniforms out;
    out.emission_color = values.emission;
    assets::for_each_map([&](ObjectMap map, std::string_view) {
        const bool is_emission = map == ObjectMap::emission || map == ObjectMap::second_emission;
        // The placeholder of these would darken the surface or make it glow.
        const bool must_be_resident =
            is_emission || map == ObjectMap::occlusion || map == ObjectMap::second_occlusion;
        const StreamedTexture *texture = material.maps[map];
        if (is_emission && texture != nullptr && !texture->resident()) {
            out.emission_color = glm::vec3(0.0F); // else all of it would glow
        }
        const bool has = texture != nullptr && (texture->resident() || !must_be_resident);
        const bool second_metal = map == ObjectMap::second_occlusion && has && texture->has_green();
        out.has_map[static_cast<std::size_t>(map)] = second_metal ? 2.0F : has ? 1.0F : 0.0F;
    });
    const StreamedTexture *occlusion = material.maps[ObjectMap::occlusion];
    const bool has_metal_map = occlusion != nullptr && occlusion->has_green();
    out.base_color = glm::vec4(values.color, values.opacity);
    out.parallax = parallax_of(values);
    out.specular_smoothness = glm::vec2(values.specular, values.smoothness);
    out.metalness = glm::vec2(values.metalness, has_metal_map ? 1.0F : 0.0F);
    out.occlusion_strength = values.occlusion_strength;
    out.alpha_cutoff = values.alpha_cutoff;
    out.translucency = values.translucency;
    out.wind_reach = values.wind_reach;
    out.beat = glm::vec4(values.beat, 0.0F);
    return out;
}

} // namespace

ObjectsPass::Lit::Lit(const PassSetup &setup, const std::string &defines)
    : program(setup.shaders, "object.vert", "object.frag", {defines}), environment(setup, program),
      solid(program.location("u_solid")) {
    assets::for_each_map([&](ObjectMap map, std::string_view name) {
        program.set_unit(("u_" + std::string(name)).c_str(), static_cast<int>(unit_of(map)));
    });
}

ObjectsPass::Depth::Depth(const PassSetup &setup, const std::string &defines)
    : program(setup.shaders, "depth.vert", "depth.frag", {defines}) {
    program.set_unit("u_color", static_cast<int>(unit_of(ObjectMap::color)));
}

ObjectsPass::ObjectsPass(const PassSetup &setup, DrawnMaterials drawn)
    : drawn_(drawn), list_(setup.scene.objects(), drawn, light_sets_per_block()),
      has_indirect_(gl::has_indirect_draws()), samplers_of_(setup.scene.material_count()),
      uniform_bytes_(gl::aligned_uniform_bytes(sizeof(gl::MaterialUniforms))),
      written_(setup.scene.material_count(), not_written()) {
    uniforms_ = gl::make_buffer(GL_UNIFORM_BUFFER, std::max<std::size_t>(written_.size(), 1) * uniform_bytes_,
                                gl::Usage::streamed);
    const bool draws_light = drawn == DrawnMaterials::solid;
    if (draws_light) {
        casters_.emplace(setup.scene.objects(), DrawnMaterials::all, light_sets_per_block());
    }
    const std::size_t most_commands =
        std::max(list_.most_commands(), casters_ ? casters_->most_commands() : 0);
    batches_.reserve(most_commands);
    if (has_indirect_) {
        indirect_ = gl::make_buffer(GL_DRAW_INDIRECT_BUFFER, sizeof(gl::IndirectDraw), gl::Usage::streamed);
        draws_.reserve(most_draws(setup.scene.objects()));
    } else {
        instances_ = gl::make_buffer(GL_ARRAY_BUFFER, sizeof(InstanceRows), gl::Usage::streamed);
        draws_.reserve(most_commands * most_primitives(setup.scene.objects()));
    }
    std::vector<std::string> lit_known;
    std::vector<std::string> depth_known;
    const auto number_in = [&](std::vector<std::string> &known, const std::string &defines, auto &programs) {
        const auto at = std::ranges::find(known, defines);
        const auto number = static_cast<std::uint32_t>(at - known.begin());
        if (at == known.end()) {
            known.push_back(defines);
            programs.emplace_back(setup, defines);
        }
        return number;
    };
    for (const Object &object : setup.scene.objects()) {
        std::vector<Programs> &programs = programs_.emplace_back();
        for (const Material &material : object.materials) {
            const assets::Material &values = material.values;
            const bool is_blended = values.alpha_mode == AlphaMode::blend;
            Programs &numbers = programs.emplace_back();
            if (is_blended == (drawn == DrawnMaterials::blended)) {
                const auto lit = [&](bool dry, bool covers) {
                    const auto number = [&](bool lights) {
                        return number_in(lit_known, lit_defines(setup.settings, values, dry, lights, covers),
                                         lit_);
                    };
                    const std::uint32_t plain = number(false);
                    return Programs::ViewPrograms{plain, object.light_sets.size() > 1 ? number(true) : plain};
                };
                numbers.whole = lit(object.dry, false);
                numbers.above_water = is_blended ? numbers.whole : lit(true, false);
                numbers.covered_whole = lit(object.dry, true);
                numbers.covered_above_water = is_blended ? numbers.covered_whole : lit(true, true);
            }
            if (draws_light) {
                numbers.depth = number_in(depth_known, depth_defines(values), depth_);
            }
            assets::for_each_map([&](ObjectMap map, std::string_view) {
                const auto &wrap = assets::is_second(map) ? values.second_wrap : values.wrap;
                const gl::Wraps wraps{wrap_of(wrap[0]), wrap_of(wrap[1])};
                const assets::Artifact *artifact = setup.scene.file().find_artifact(values.maps[map]);
                const std::optional<int> max_level = artifact != nullptr ? artifact->max_level : std::nullopt;
                samplers_of_[material.id][map] = sampler(wraps, values.nearest, max_level, setup.settings);
            });
        }
    }
}

const ObjectsPass::Programs &ObjectsPass::programs_of(const DrawCommand &command) const {
    return programs_[list_.index_of(*command.object)][command.material];
}

unsigned ObjectsPass::sampler(gl::Wraps wraps, bool nearest, std::optional<int> max_level,
                              const RenderSettings &settings) {
    for (const CachedSampler &cached : samplers_) {
        if (cached.wraps == wraps && cached.nearest == nearest && cached.max_level == max_level) {
            return cached.sampler.name();
        }
    }
    samplers_.push_back({wraps, nearest, max_level,
                         gl::make_sampler(wraps, gl::Filter::mipmapped, settings.anisotropy, max_level,
                                          settings.mip_bias, nearest)});
    return samplers_.back().sampler.name();
}

void ObjectsPass::forget_state() {
    program_.reset();
    material_.reset();
    light_block_.reset();
    two_sided_.reset();
    mirrored_.reset();
    maps_ = {};
    bound_ = {};
}

void ObjectsPass::bind_map(const Material &material, ObjectMap map) {
    const BoundMap wanted{material.maps[map], samplers_of_[material.id][map]};
    if (wanted.texture != nullptr && maps_[map] != wanted) {
        wanted.texture->bind(unit_of(map), wanted.sampler);
        maps_[map] = wanted;
    }
}

void ObjectsPass::bind_uniforms(const Material &material) {
    const std::size_t offset = material.id * uniform_bytes_;
    if (const gl::MaterialUniforms now = uniforms_of(material); written_[material.id] != now) {
        written_[material.id] = now;
        gl::write_buffer(GL_UNIFORM_BUFFER, uniforms_, offset, std::as_bytes(std::span(&now, 1)));
    }
    glBindBufferRange(GL_UNIFORM_BUFFER, gl::material_uniforms_binding, uniforms_.name(),
                      static_cast<GLintptr>(offset), sizeof(gl::MaterialUniforms));
}

std::uint32_t ObjectsPass::lit_program(const Frame &frame, const View &view,
                                       const DrawCommand &command) const {
    const Programs &all = programs_of(command);
    const bool above = frame.hides_under_water(view);
    const Programs::ViewPrograms &programs = view.kind == ViewKind::main
                                                 ? (above ? all.covered_above_water : all.covered_whole)
                                                 : (above ? all.above_water : all.whole);
    return command.by_lights ? programs.by_lights : programs.lit;
}

void ObjectsPass::use_lit(const Frame &frame, const View &view, const DrawCommand &command) {
    const Material &material = command.object->materials[command.material];
    const std::uint32_t number = lit_program(frame, view, command);
    const Lit &lit = lit_[number];
    if (command.by_lights && light_block_ != command.light_block) {
        light_block_ = command.light_block;
        frame.point_lights.bind_block(command.light_block);
    }
    if (program_ != number) {
        program_ = number;
        material_.reset();
        lit.program.use();
        lit.environment.apply(frame, view);
    }
    if (material_ == material.id) {
        return;
    }
    material_ = material.id;
    assets::for_each_map([&](ObjectMap map, std::string_view) { bind_map(material, map); });
    bind_uniforms(material);
}

void ObjectsPass::use_depth(const DrawCommand &command) {
    const Material &material = command.object->materials[command.material];
    const assets::Material &values = material.values;
    const std::uint32_t number = programs_of(command).depth;
    const Depth &depth = depth_[number];
    if (program_ != number) {
        program_ = number;
        material_.reset();
        depth.program.use();
    }
    if (material_ == material.shadow_id) {
        return;
    }
    material_ = material.shadow_id;
    if (values.alpha_mode != AlphaMode::opaque) {
        bind_map(material, ObjectMap::color);
    }
    if (values.alpha_mode != AlphaMode::opaque || values.beats) {
        bind_uniforms(material);
    }
}

void ObjectsPass::bind_instances(const GeometryPage &page, const gl::Buffer &instances, std::size_t first) {
    if (const BoundInstances wanted{&page, first}; bound_ != wanted) {
        bound_ = wanted;
        bind_page(page, instances, first);
    }
}

void ObjectsPass::draw_batch(const Frame &frame, const Batch &batch, const View &view) {
    const DrawCommand &command = *batch.command;
    if (const bool mirrored = command.mirrored != view.mirrored; mirrored_ != mirrored) {
        mirrored_ = mirrored;
        glFrontFace(mirrored ? GL_CW : GL_CCW);
    }
    const GeometryPage &page = command.object->mesh->page(command.lod);
    const auto draw = [&] {
        if (has_indirect_ && batch.count != 0) {
            bind_instances(page, frame.instances(), 0);
            gl::draw_indirect(page.layout.index_type(), batch.first, batch.count);
            return;
        }
        for (const gl::IndirectDraw &one : std::span(draws_).subspan(batch.first, batch.count)) {
            bind_instances(page, instances_, one.first_instance);
            gl::draw_triangles(one, page.layout.index_type());
        }
    };
    const assets::Material &values = command.object->materials[command.material].values;
    const bool two_sided = values.two_sided;
    const auto cull = [&](bool both_sides) {
        if (two_sided_ != both_sides) {
            two_sided_ = both_sides;
            (both_sides ? glDisable : glEnable)(GL_CULL_FACE);
        }
    };
    if (drawn_ != DrawnMaterials::blended) {
        cull(two_sided);
        draw();
        return;
    }
    const int solid = lit_[*program_].solid;
    if (values.opacity == 1.0F) {
        // Texels of alpha 1 come first: they hide all behind them, whatever the order of triangles.
        cull(two_sided);
        glUniform1f(solid, 1.0F);
        glDepthMask(GL_TRUE);
        draw();
        glDepthMask(GL_FALSE);
    }
    cull(false);
    glUniform1f(solid, 0.0F);
    if (two_sided) {
        // Back faces first, which is the right order for convex shapes.
        glCullFace(GL_FRONT);
        draw();
        glCullFace(GL_BACK);
    }
    draw();
}

bool ObjectsPass::is_alike(const Frame &frame, const View &view, const DrawCommand &a,
                           const DrawCommand &b) const {
    const Material &first = a.object->materials[a.material];
    const Material &second = b.object->materials[b.material];
    if (a.mirrored != b.mirrored || a.by_lights != b.by_lights || a.light_block != b.light_block ||
        &a.object->mesh->page(a.lod) != &b.object->mesh->page(b.lod)) {
        return false;
    }
    if (view.kind == ViewKind::light) {
        return first.shadow_id == second.shadow_id;
    }
    // Of a two-sided blended one the back faces come first, so that each is drawn twice.
    const bool each_twice = drawn_ == DrawnMaterials::blended && first.values.two_sided;
    return first.id == second.id && lit_program(frame, view, a) == lit_program(frame, view, b) && !each_twice;
}

void ObjectsPass::add_draws(const DrawList &list, const DrawCommand &command) {
    Batch &batch = batches_.back();
    const RowRange copied{command.first, command.count};
    const std::span<const RowRange> ranges = has_indirect_ ? list.ranges_of(command) : std::span(&copied, 1);
    command.object->mesh->for_each_draw(command.lod, command.material, [&](gl::IndirectDraw draw) {
        draw.instances = ranges.front().count;
        draw.first_instance = ranges.front().first;
        // Commands of an object at a level have the same ranges.
        if (batch.count >= ranges.size() && follows(draws_[draws_.size() - ranges.size()], draw)) {
            for (gl::IndirectDraw &before : std::span(draws_).last(ranges.size())) {
                before.index_count += draw.index_count;
            }
            return;
        }
        for (const RowRange &range : ranges) {
            draw.instances = range.count;
            draw.first_instance = range.first;
            draws_.push_back(draw);
        }
        batch.count += ranges.size();
    });
}

void ObjectsPass::make_batches(const DrawList &list, const Frame &frame, const View &view) {
    batches_.clear();
    draws_.clear();
    for (const DrawCommand &command : list.commands()) {
        if (batches_.empty() || !is_alike(frame, view, *(&command - 1), command)) {
            batches_.push_back({&command, draws_.size(), 0});
        }
        add_draws(list, command);
    }
    if (has_indirect_ && !draws_.empty()) {
        gl::replace_buffer(GL_DRAW_INDIRECT_BUFFER, indirect_, std::as_bytes(std::span(draws_)));
    }
}

bool ObjectsPass::fill(DrawList &list, const Frame &frame, const View &view) {
    const CpuTimer timer(frame.scene_ms);
    const bool shaded = view.kind != ViewKind::light && frame.point_lights.any_lit();
    list.fill(frame.visible(view.kind), view, frame.transforms(),
              shaded ? frame.point_lights.lit() : std::span<const std::uint8_t>());
    if (list.commands().empty()) {
        return false;
    }
    const std::size_t count = list.instance_count();
    if (!has_indirect_ &&
        !gl::refill_buffer(GL_ARRAY_BUFFER, instances_, count * sizeof(InstanceRows), [&](std::byte *rows) {
            list.write_instances(frame.transforms().rows(), {reinterpret_cast<InstanceRows *>(rows), count});
        })) {
        return false;
    }
    make_batches(list, frame, view);
    return true;
}

void ObjectsPass::draw_depth(const Frame &frame, const View &light) {
    if (!fill(*casters_, frame, light)) {
        return;
    }
    forget_state();
    depth_bias(true);
    for (const Batch &batch : batches_) {
        use_depth(*batch.command);
        draw_batch(frame, batch, light);
    }
    depth_bias(false);
    glEnable(GL_CULL_FACE);
    glFrontFace(light.mirrored ? GL_CW : GL_CCW);
}

void ObjectsPass::draw(const Frame &frame, const View &view) {
    if (view.kind == ViewKind::light) {
        if (casters_) {
            draw_depth(frame, view);
        }
        return;
    }
    if (!fill(list_, frame, view)) {
        return;
    }
    forget_state();
    const bool blended = drawn_ == DrawnMaterials::blended;
    const bool covers = !blended && view.kind == ViewKind::main && view.samples > 1;
    const gl::LateDepthTest late(!blended && frame.tests_depth_late(view));
    if (covers) {
        glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
    if (blended) {
        glEnable(GL_BLEND);
        // The refraction view's alpha holds the depth of what lies behind.
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
        glDepthMask(GL_FALSE);
    }
    for (const Batch &batch : batches_) {
        use_lit(frame, view, *batch.command);
        draw_batch(frame, batch, view);
    }
    if (blended) {
        glDisable(GL_BLEND);
        glDepthMask(GL_TRUE);
    }
    if (covers) {
        glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
    glEnable(GL_CULL_FACE);
    glFrontFace(view.mirrored ? GL_CW : GL_CCW);
}

} // namespace paradize
