#include "streaming/scene.hpp"

#include "error.hpp"
#include "scene/motion.hpp"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace paradize {

glm::vec2 parallax_of(const assets::Material &material) {
    const glm::vec2 asked(material.parallax_scale, material.parallax_bias);
    const float reach = 0.5F * std::abs(asked.x) + std::abs(asked.y);
    const float limit = material.parallax_limit.value_or(reach);
    return reach > limit ? asked * (limit / reach) : asked;
}

bool drawn_in(const assets::Object &object, ViewKind view) {
    switch (view) {
    case ViewKind::light:
        return object.shadow;
    case ViewKind::mirror:
        return object.reflection;
    case ViewKind::refraction:
        return object.refraction;
    case ViewKind::main:
        break;
    }
    return object.camera;
}

/// Returns the height of the lowest corner of a mesh's box where `model` places it.
static double lowest(const glm::dmat4 &model, const StreamedMesh &mesh) {
    double y = model[3].y;
    for (int axis = 0; axis < 3; ++axis) {
        y += std::min(model[axis].y * mesh.low()[axis], model[axis].y * mesh.high()[axis]);
    }
    return y;
}

Scene::Scene(const assets::SceneFile &file, const Streamer &streamer) : file_(file), streamer_(streamer) {
    objects_.reserve(file_.objects.size());
    for (const assets::Object &entry : file_.objects) {
        Object &object = objects_.emplace_back();
        object.file = &entry;
        object.mesh = mesh(entry.mesh);
        if (object.mesh->levels().size() != entry.lods.size()) {
            throw Error("scene.json: object " + entry.name + " has " + std::to_string(entry.lods.size()) +
                        " lods, its mesh " + entry.mesh + " has " +
                        std::to_string(object.mesh->levels().size()) + "; bake the scene again");
        }
        for (std::size_t i = 0; i < entry.lods.size(); ++i) {
            if (const std::string &node = object.mesh->levels()[i].node; entry.lods[i].node != node) {
                throw Error("scene.json: object " + entry.name + ": lods[" + std::to_string(i) +
                            "].node: is " + entry.lods[i].node + ", level " + std::to_string(i) +
                            " of its mesh " + entry.mesh + " is " + node + "; bake the scene again");
            }
        }
        for (std::size_t m = 0; m < object.mesh->materials().size(); ++m) {
            const std::string &name = object.mesh->materials()[m];
            const auto found =
                std::find_if(entry.materials.begin(), entry.materials.end(),
                             [&](const assets::Material &material) { return material.name == name; });
            Material &material = object.materials.emplace_back();
            material.values = found != entry.materials.end() ? *found : assets::Material();
            assets::for_each_map([&](assets::ObjectMap map, std::string_view) {
                material.maps[map] = texture(material.values.maps[map]);
            });
            material.id = id_of(material.values);
            material.shadow_id = shadow_id_of(material.id);
            object.glows = object.glows || material.values.emission != glm::vec3(0.0F);
            material.center = object.mesh->measure(m).center;
        }
        add_instances(object);
        object.tree = InstanceTree(object.instances);
        for (const assets::ObjectLod &lod : entry.lods) {
            object.errors_m.push_back(lod.error_m);
        }
        instance_count_ += object.instances.size();
    }
    move(0.0);
}

/// Places an instance: `stand` leads from the object's space to the world.
static void place(Instance &instance, const glm::dmat4 &stand, const Object &object) {
    instance.model = stand * model_of(object.mesh->grid());
    instance.center = glm::dvec3(stand * glm::dvec4(object.file->center, 1.0));
}

void Scene::add_instances(Object &object) {
    const assets::Object &entry = *object.file;
    // How far wings and legs reach beyond the sphere, per metre of its radius.
    const double beaten = entry.motion ? entry.motion->beat.lift_rad + entry.motion->beat.swing_rad : 0.0;
    for (const assets::Placement &placement : entry.instances) {
        Instance &instance = object.instances.emplace_back();
        instance.number = static_cast<std::uint32_t>(object.instances.size() - 1);
        if (!entry.light_sets.empty()) {
            const std::uint32_t set = entry.light_sets[instance.number];
            const auto known = std::ranges::find(object.light_sets, set);
            instance.light = static_cast<std::uint32_t>(known - object.light_sets.begin());
            if (known == object.light_sets.end()) {
                object.light_sets.push_back(set);
            }
            instance.beat.w = static_cast<float>(set);
        }
        const glm::dvec3 &scale = placement.scale;
        glm::dmat4 stand = glm::translate(glm::dmat4(1.0), placement.position);
        stand = glm::scale(stand * glm::mat4_cast(placement.rotation), scale);
        place(instance, stand, object);
        for (const Material &material : object.materials) {
            if (material.values.sways()) {
                instance.beat = glm::vec4(material.values.wind_reach, 0.0F, instance.beat.w);
            }
        }
        instance.scale =
            static_cast<float>(std::max({std::abs(scale.x), std::abs(scale.y), std::abs(scale.z)}));
        instance.mirrored = scale.x * scale.y * scale.z < 0.0;
        instance.radius_m =
            entry.radius_m * instance.scale * static_cast<float>(1.0 + beaten) + entry.reach_m;
        if (file_.water) {
            const double lowest_m =
                entry.motion ? instance.center.y - reach_of(*entry.motion) -
                                   2.0 * (glm::length(entry.center) * instance.scale + instance.radius_m)
                             : lowest(instance.model, *object.mesh) - entry.reach_m;
            object.dry = object.dry && lowest_m > file_.water->level_m;
        }
    }
}

void Scene::move(double flight_s) {
    const double share = flight_s / file_.flight.duration_s;
    for (Object &object : objects_) {
        if (!object.moves()) {
            continue;
        }
        for (Instance &instance : object.instances) {
            const assets::Placement &placement = object.file->instances[instance.number];
            const Moved moved = moved_at(*object.file->motion, placement, instance.number, share);
            place(instance, moved.stand, object);
            if (object.file->motion->beat.per_lap != 0) {
                instance.beat = glm::vec4(glm::vec3(moved.beat), instance.beat.w);
            }
        }
        object.tree.refit(object.instances);
    }
}

std::uint32_t Scene::id_of(assets::Material material) {
    material.name.clear();
    const auto found = std::ranges::find(distinct_materials_, material);
    const auto id = static_cast<std::uint32_t>(found - distinct_materials_.begin());
    if (found == distinct_materials_.end()) {
        distinct_materials_.push_back(std::move(material));
    }
    return id;
}

std::uint32_t Scene::shadow_id_of(std::uint32_t id) const {
    const assets::Material &of = distinct_materials_[id];
    const auto shadow = [](const assets::Material &one) {
        const glm::vec2 reach = one.beats ? one.wind_reach : glm::vec2(0.0F); // else of each instance
        return std::tuple(one.alpha_mode, one.two_sided, one.sways(), one.beats, reach.x, reach.y, one.beat.x,
                          one.beat.y, one.beat.z);
    };
    for (std::uint32_t first = 0; of.alpha_mode == assets::AlphaMode::opaque && first < id; ++first) {
        if (shadow(distinct_materials_[first]) == shadow(of)) {
            return first;
        }
    }
    return id;
}

const StreamedTexture *Scene::texture(std::string_view artifact) const {
    return streamer_.texture(artifact);
}

const StreamedMesh *Scene::mesh(std::string_view artifact) const {
    return streamer_.mesh(artifact);
}

void Scene::collect(const View &view, const glm::vec3 &eye, float pixels_at_1m, float error_px,
                    std::vector<DrawItem> &items) const {
    for (const Object &object : objects_) {
        if (!drawn_in(*object.file, view.kind)) {
            continue;
        }
        const std::size_t first_item = items.size();
        object.tree.collect(view, object.lod_query(view.kind, eye, pixels_at_1m, error_px),
                            [&](const InstanceRange &seen) {
                                const int lod = object.mesh->best_level(seen.lod);
                                if (lod < 0) {
                                    return;
                                }
                                if (items.size() > first_item) {
                                    DrawItem &last = items.back();
                                    if (last.first + last.count == seen.first && last.lod == lod &&
                                        last.mirrored == seen.mirrored) {
                                        last.count += seen.count;
                                        return;
                                    }
                                }
                                if (items.size() < items.capacity()) {
                                    items.push_back({&object, seen.first, seen.count, lod, seen.mirrored});
                                }
                            });
    }
}

} // namespace paradize
