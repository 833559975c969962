// The order of draw calls, and the transforms of their instances.

#include "passes/draw_list.hpp"

#include <doctest/doctest.h>
#include <glm/ext/matrix_transform.hpp>

#include <array>
#include <string>
#include <vector>

using namespace paradize;
using assets::AlphaMode;

namespace {

Material material(std::uint32_t id, AlphaMode mode = AlphaMode::opaque, bool two_sided = false) {
    Material out;
    out.id = id;
    out.values.alpha_mode = mode;
    out.values.two_sided = two_sided;
    return out;
}

Instance standing(double z, bool mirrored = false) {
    Instance out;
    out.model = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, z));
    out.mirrored = mirrored;
    return out;
}

View eye_at(float z) {
    View view;
    view.eye = {0.0F, 0.0F, z};
    return view;
}

/// One word per command: object, material, level, number of instances.
std::vector<std::string> words(const DrawList &list, const std::vector<Object> &objects) {
    std::vector<std::string> out;
    for (const DrawCommand &command : list.commands()) {
        out.push_back(std::to_string(command.object - objects.data()) + ":" +
                      std::to_string(command.material) + ":" + std::to_string(command.lod) + " x" +
                      std::to_string(command.count) + (command.mirrored ? " mirrored" : ""));
    }
    return out;
}

/// The instances' transforms: copied, and by ranges of each command.
std::vector<InstanceRows> instances_of(const DrawList &list, const InstanceTransforms &transforms) {
    std::vector<InstanceRows> rows(list.instance_count());
    list.write_instances(transforms.rows(), rows);
    for (const DrawCommand &command : list.commands()) {
        std::uint32_t at = command.first;
        for (const RowRange &range : list.ranges_of(command)) {
            for (std::uint32_t i = 0; i < range.count; ++i, ++at) {
                CHECK(transforms.rows()[range.first + i] == rows[at]);
            }
        }
        CHECK(at == command.first + command.count);
    }
    return rows;
}

/// Returns the transforms of its instances.
std::vector<InstanceRows> fill(DrawList &list, std::span<const DrawItem> items,
                               std::span<const Object> objects, const View &view) {
    InstanceTransforms transforms(objects);
    transforms.update(view.anchor);
    list.fill(items, view, transforms);
    return instances_of(list, transforms);
}

/// Gives each object one instance, and returns them.
std::vector<DrawItem> one_of_each(std::vector<Object> &objects) {
    std::vector<DrawItem> items;
    for (Object &object : objects) {
        object.instances = {standing(0.0)};
        items.push_back({&object, 0, 1, 0});
    }
    return items;
}

using Words = std::vector<std::string>;

} // namespace

TEST_CASE("draw list: instances of a level are one command, mirrored ones another") {
    std::vector<Object> objects(1);
    objects[0].materials = {material(0), material(1)};
    objects[0].instances = {standing(1.0), standing(2.0), standing(3.0, true), standing(4.0), standing(5.0)};
    objects[0].errors_m = {0.0F, 0.1F};
    const std::vector<DrawItem> items{{&objects[0], 0, 1, 1},
                                      {&objects[0], 1, 1, 0},
                                      {&objects[0], 2, 1, 0, true},
                                      {&objects[0], 3, 1, 1},
                                      {&objects[0], 4, 1, 0}};
    DrawList list(objects, DrawnMaterials::solid);
    const auto rows = fill(list, items, objects, eye_at(0.0F));
    CHECK(words(list, objects) ==
          Words{"0:0:0 x2", "0:0:1 x2", "0:0:0 x1 mirrored", "0:1:0 x2", "0:1:1 x2", "0:1:0 x1 mirrored"});
    REQUIRE(rows.size() == 5);
    const auto &coarse = list.commands()[1];
    CHECK(rows[coarse.first][2].w == 1.0F); // rows of the model matrix, the last is z
    CHECK(rows[coarse.first + 1][2].w == 4.0F);
}

TEST_CASE("draw list: instances of all light sets are one command, those of other blocks another") {
    std::vector<Object> objects(2);
    for (Object &object : objects) {
        object.materials = {material(0)};
        object.light_sets = {0, 4, 7};
        object.instances = {standing(1.0), standing(2.0), standing(3.0), standing(4.0), standing(5.0)};
        for (std::uint32_t i = 0; i < 5; ++i) {
            object.instances[i].light = std::array<std::uint32_t, 5>{0, 1, 2, 1, 0}[i];
        }
    }
    objects[1].light_sets = {0, 5, 6};
    const std::vector<DrawItem> items{{&objects[0], 0, 3, 0}, {&objects[0], 3, 2, 0}};
    InstanceTransforms transforms(objects);
    transforms.update(glm::dvec3(0.0));
    const auto filled = [&](DrawList &list, std::vector<std::uint8_t> lit) {
        list.fill(items, eye_at(0.0F), transforms, lit);
        const auto rows = instances_of(list, transforms);
        std::vector<std::string> out;
        for (const DrawCommand &command : list.commands()) {
            std::string text =
                command.by_lights ? "lit " + std::to_string(command.light_block) + ":" : "dark:";
            for (std::uint32_t i = 0; i < command.count; ++i) {
                text += " " + std::to_string(static_cast<int>(rows[command.first + i][2].w));
            }
            out.push_back(text);
        }
        return out;
    };
    DrawList one(objects, DrawnMaterials::solid, 8);
    CHECK(filled(one, {}) == Words{"dark: 1 2 3 4 5"});
    CHECK(filled(one, {0, 0, 0, 0, 0, 1, 1, 0}) == Words{"dark: 1 2 3 4 5"}); // not its sets
    CHECK(filled(one, {0, 0, 0, 0, 0, 0, 0, 1}) == Words{"lit 0: 1 2 3 4 5"});
    DrawList more(objects, DrawnMaterials::solid, 3);
    CHECK(filled(more, {0, 0, 0, 0, 1, 0, 0, 1}) == Words{"lit 0: 1 5", "lit 1: 2 4", "lit 2: 3"});
    CHECK(filled(more, {0, 0, 0, 0, 0, 0, 0, 0}) == Words{"dark: 1 2 3 4 5"});
}

TEST_CASE("draw list: programs change least, then materials, then meshes") {
    std::vector<Object> objects(3);
    objects[0].materials = {material(2, AlphaMode::mask), material(1)};
    objects[1].materials = {material(0), material(2, AlphaMode::mask)};
    objects[2].materials = {material(1), material(3, AlphaMode::blend)};
    const std::vector<DrawItem> items = one_of_each(objects);
    DrawList list(objects, DrawnMaterials::solid);
    fill(list, items, objects, eye_at(5.0F));
    CHECK(words(list, objects) == Words{"1:0:0 x1", "0:1:0 x1", "2:0:0 x1", "0:0:0 x1", "1:1:0 x1"});
    DrawList all(objects, DrawnMaterials::all);
    fill(all, items, objects, eye_at(5.0F));
    CHECK(words(all, objects).back() == "2:1:0 x1");
    CHECK(all.commands().size() == 6);
}

TEST_CASE("draw list: blended materials come back to front, neighbours of one kind in one command") {
    std::vector<Object> objects(2);
    objects[0].materials = {material(0), material(1, AlphaMode::blend)};
    objects[0].instances = {standing(3.0), standing(-2.0), standing(-1.0)};
    objects[1].materials = {material(2, AlphaMode::blend), material(3, AlphaMode::blend)};
    objects[1].materials[1].center = {0.0F, 0.0F, -4.0F}; // behind the mesh's origin
    objects[1].instances = {standing(0.0)};
    std::vector<DrawItem> items;
    for (Object &object : objects) {
        items.push_back({&object, 0, static_cast<std::uint32_t>(object.instances.size()), 0});
    }
    DrawList list(objects, DrawnMaterials::blended);
    const auto rows = fill(list, items, objects, eye_at(9.0F));
    CHECK(words(list, objects) == Words{"1:1:0 x1", "0:1:0 x2", "1:0:0 x1", "0:1:0 x1"});
    CHECK(rows[1][2].w == -2.0F);
    CHECK(rows[2][2].w == -1.0F);
    fill(list, items, objects, eye_at(-9.0F));
    CHECK(words(list, objects) == Words{"0:1:0 x1", "1:0:0 x1", "0:1:0 x2", "1:1:0 x1"});
}

TEST_CASE("draw list: a two-sided blended material is a command for each instance") {
    std::vector<Object> objects(1);
    objects[0].materials = {material(0, AlphaMode::blend, true)};
    objects[0].instances = {standing(0.0), standing(1.0)};
    const std::vector<DrawItem> items{{&objects[0], 0, 2, 0}};
    DrawList list(objects, DrawnMaterials::blended);
    fill(list, items, objects, eye_at(5.0F));
    CHECK(words(list, objects) == Words{"0:0:0 x1", "0:0:0 x1"});
}

TEST_CASE("draw list: nothing is drawn of what is not visible, and an empty list is not an error") {
    std::vector<Object> objects(1);
    objects[0].materials = {material(0)};
    objects[0].instances = {standing(0.0)};
    for (const DrawnMaterials drawn : {DrawnMaterials::solid, DrawnMaterials::blended, DrawnMaterials::all}) {
        DrawList list(objects, drawn);
        fill(list, {}, objects, eye_at(0.0F));
        CHECK(list.commands().empty());
        CHECK(list.instance_count() == 0);
    }
}

TEST_CASE("draw list: casters come by what their shadows need of a material") {
    std::vector<Object> objects(3);
    objects[0].materials = {material(0), material(1, AlphaMode::mask)};
    objects[1].materials = {material(2)};
    objects[2].materials = {material(3)};
    objects[0].materials[1].shadow_id = 1;
    objects[1].materials[0].shadow_id = 2; // two-sided, say
    const std::vector<DrawItem> items = one_of_each(objects);
    DrawList casters(objects, DrawnMaterials::all);
    fill(casters, items, objects, eye_at(5.0F));
    CHECK(words(casters, objects) == Words{"0:0:0 x1", "2:0:0 x1", "1:0:0 x1", "0:1:0 x1"});
    DrawList solid(objects, DrawnMaterials::solid);
    fill(solid, items, objects, eye_at(5.0F));
    CHECK(words(solid, objects) == Words{"0:0:0 x1", "1:0:0 x1", "2:0:0 x1", "0:1:0 x1"});
}
