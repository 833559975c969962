// The tree of an object's instances against a look at each of them.

#include "scene/camera.hpp"
#include "scene/instances.hpp"
#include "streaming/scene.hpp"

#include <doctest/doctest.h>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <random>
#include <vector>

using namespace paradize;

namespace {

constexpr std::array<float, 4> errors_m{0.0F, 0.02F, 0.09F, 0.3F};

Instance standing(const glm::dvec3 &at, float scale, bool mirrored = false) {
    Instance out;
    out.model = glm::translate(glm::dmat4(1.0), at);
    out.center = at + glm::dvec3(0.0, static_cast<double>(scale), 0.0);
    out.radius_m = 1.3F * scale;
    out.scale = scale;
    out.mirrored = mirrored;
    return out;
}

/// Instances in a square around `middle`; a tenth is mirrored.
std::vector<Instance> scattered(std::size_t count, double edge_m, const glm::dvec3 &middle,
                                std::mt19937 &random) {
    std::uniform_real_distribution<double> place(-0.5 * edge_m, 0.5 * edge_m);
    std::uniform_real_distribution<float> scale(0.1F, 3.0F);
    std::vector<Instance> out;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 at = middle + glm::dvec3(place(random), 0.02 * place(random), place(random));
        out.push_back(standing(at, scale(random), i % 10 == 0));
    }
    return out;
}

/// One number per instance: its level, or -1 where it is not seen.
std::vector<int> one_by_one(std::span<const Instance> instances, const View &view, const LodQuery &query) {
    std::vector<int> out;
    for (const Instance &instance : instances) {
        const glm::vec3 center = view.local(instance.center);
        const float distance_m = glm::distance(query.eye, center) - instance.radius_m;
        out.push_back(
            view.sees(center, instance.radius_m) &&
                    2.0F * instance.radius_m * query.pixels_at_1m / std::max(distance_m, 1e-3F) >
                        query.least_px
                ? choose_lod(query.errors_m, distance_m, query.pixels_at_1m * instance.scale, query.error_px)
                : -1);
    }
    return out;
}

std::vector<int> by_tree(const InstanceTree &tree, std::span<const Instance> instances, const View &view,
                         const LodQuery &query) {
    std::vector<int> out(instances.size(), -1);
    std::uint32_t end = 0;
    tree.collect(view, query, [&](const InstanceRange &range) {
        CHECK(range.first >= end); // in the order of the list, none twice
        end = range.first + range.count;
        for (std::uint32_t i = range.first; i < end; ++i) {
            CHECK(instances[i].mirrored == range.mirrored);
            out[i] = range.lod;
        }
    });
    return out;
}

std::array<View, view_kinds> views_from(const glm::dvec3 &eye, const glm::dvec3 &target) {
    assets::SceneFile file;
    file.flight.fov_rad = 0.9F;
    file.flight.near_m = 0.2F;
    file.flight.far_m = 300.0F;
    file.water.emplace();
    file.shadow.emplace();
    file.shadow->center = target;
    Pose pose;
    pose.eye = eye;
    pose.target = target;
    return frame_views(file, RenderSettings(), pose, 640, 360, glm::normalize(glm::vec3(0.6F, 0.6F, 0.5F)));
}

} // namespace

TEST_CASE("instances: the tree finds what a look at each instance finds, in every view") {
    std::mt19937 random(5);
    // A field; and heaps of small and large ones, which a border of the view often divides.
    for (const auto &[count, edge_m] : std::vector<std::pair<std::size_t, double>>{{1, 150.0},
                                                                                   {2, 150.0},
                                                                                   {32, 150.0},
                                                                                   {33, 150.0},
                                                                                   {3000, 150.0},
                                                                                   {8, 2.0},
                                                                                   {20, 2.0},
                                                                                   {60, 2.0}}) {
        for (const double far_m : {0.0, 1e5}) {
            const glm::dvec3 middle(far_m, 0.0, -far_m);
            std::vector<Instance> instances = scattered(count, edge_m, middle, random);
            const InstanceTree tree(instances);
            std::uniform_real_distribution<double> place(-90.0, 90.0);
            for (int look = 0; look < (edge_m < 10.0 ? 60 : 6); ++look) {
                const auto views = views_from(
                    middle + glm::dvec3(place(random), 0.4 + std::abs(place(random)) / 9.0, place(random)),
                    middle + glm::dvec3(place(random), 0.0, place(random)));
                const View &main = views[static_cast<std::size_t>(ViewKind::main)];
                for (const View &view : views) {
                    const bool light = view.kind == ViewKind::light;
                    const LodQuery query{light ? main.eye : view.eye,
                                         light ? main.pixels_at_1m : view.pixels_at_1m, 1.0F, errors_m,
                                         look % 3 == 0 ? 0.0F : 12.0F};
                    const std::vector<int> expected = one_by_one(instances, view, query);
                    CHECK(by_tree(tree, instances, view, query) == expected);
                    NearestInstance nearest{0.0F, 4};
                    tree.find_nearest(view, query, main.near_m, nearest);
                    NearestInstance most{0.0F, 4};
                    float largest = 0.0F;
                    for (std::size_t i = 0; i < count; ++i) {
                        if (expected[i] >= 0) {
                            const float distance_m =
                                glm::distance(query.eye, view.local(instances[i].center)) -
                                instances[i].radius_m;
                            most.pixels_per_m =
                                std::max(most.pixels_per_m, query.pixels_at_1m * instances[i].scale /
                                                                std::max(distance_m, main.near_m));
                            most.lod = std::min(most.lod, expected[i]);
                        }
                        if (view.sees(view.local(instances[i].center), instances[i].radius_m)) {
                            largest = std::max(largest, instances[i].scale);
                        }
                    }
                    CHECK(nearest.pixels_per_m == most.pixels_per_m);
                    CHECK(nearest.lod == most.lod);
                    CHECK(tree.largest_scale(view) == largest);
                }
            }
        }
    }
}

TEST_CASE("instances: all of them at one place, and none, are no special cases") {
    std::vector<Instance> none;
    CHECK(InstanceTree(none).size() == 0);
    std::vector<Instance> pile(500, standing({3.0, 0.0, -4.0}, 1.0F));
    const InstanceTree tree(pile);
    const auto views = views_from({0.0, 2.0, 9.0}, {3.0, 0.0, -4.0});
    const View &main = views[static_cast<std::size_t>(ViewKind::main)];
    const LodQuery query{main.eye, main.pixels_at_1m, 1.0F, errors_m};
    CHECK(by_tree(tree, pile, main, query) == one_by_one(pile, main, query));
}

TEST_CASE("instances: a field far away is one range, and what is behind the eye is none") {
    std::mt19937 random(2);
    std::vector<Instance> field = scattered(4000, 20.0, {0.0, 0.0, -150.0}, random);
    std::ranges::for_each(field, [](Instance &instance) { instance.mirrored = false; });
    const InstanceTree tree(field);
    const auto ranges = [&](const glm::dvec3 &target) {
        const auto views = views_from({0.0, 30.0, 0.0}, target);
        const View &main = views[static_cast<std::size_t>(ViewKind::main)];
        std::vector<InstanceRange> out;
        tree.collect(main, {main.eye, main.pixels_at_1m, 2.0F, std::array{0.0F, 0.0001F}},
                     [&](const InstanceRange &one) { out.push_back(one); });
        return out;
    };
    CHECK(ranges({0.0, 0.0, -150.0}) == std::vector{InstanceRange{0, 4000, 1}});
    CHECK(ranges({0.0, 30.0, 150.0}).empty());
}

TEST_CASE("instances: their transforms are those of the models, relative to the anchor") {
    const std::vector<Instance> instances{standing({1e6 + 1.0, 2.0, 3.0}, 1.0F)};
    std::array<InstanceRows, 1> rows;
    find_rows(instances, {1e6, 0.0, 1.0}, rows);
    CHECK(rows[0][0] == glm::vec4(1.0F, 0.0F, 0.0F, 1.0F));
    CHECK(rows[0][1] == glm::vec4(0.0F, 1.0F, 0.0F, 2.0F));
    CHECK(rows[0][2] == glm::vec4(0.0F, 0.0F, 1.0F, 2.0F));
}
