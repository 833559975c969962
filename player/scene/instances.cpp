#include "scene/instances.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace paradize {

namespace {

constexpr std::uint32_t leaf_instances = 32;
// Bounds are widened by more than what float32 rounds away, so that a box never decides against an instance.
constexpr float widening = 1e-5F;

} // namespace

void find_rows(std::span<const Instance> instances, const glm::dvec3 &anchor, std::span<InstanceRows> rows) {
    for (std::size_t i = 0; i < instances.size(); ++i) {
        glm::dmat4 model = instances[i].model;
        model[3] -= glm::dvec4(anchor, 0.0);
        const glm::mat4 transposed = glm::transpose(glm::mat4(model));
        rows[i] = {transposed[0], transposed[1], transposed[2], instances[i].beat};
    }
}

int choose_lod(std::span<const float> errors_m, float distance_m, float pixels_at_1m, float error_px) {
    const float pixels_per_m = pixels_at_1m / std::max(distance_m, 1e-3F);
    for (std::size_t lod = errors_m.size(); lod-- > 1;) {
        if (errors_m[lod] * pixels_per_m <= error_px) {
            return static_cast<int>(lod);
        }
    }
    return 0;
}

/// The same with a query, of an instance; negative where it is left out.
static int choose_lod(const LodQuery &query, float distance_m, float scale, float radius_m) {
    const float wide_px = 2.0F * radius_m * query.pixels_at_1m / std::max(distance_m, 1e-3F);
    return wide_px <= query.least_px
               ? -1
               : choose_lod(query.errors_m, distance_m, query.pixels_at_1m * scale, query.error_px);
}

InstanceTree::InstanceTree(std::vector<Instance> &instances) {
    std::vector<std::uint32_t> order(instances.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto mirrored =
        std::ranges::stable_partition(order, [&](std::uint32_t i) { return !instances[i].mirrored; });
    const auto count = static_cast<std::uint32_t>(mirrored.size());
    const auto total = static_cast<std::uint32_t>(order.size());
    build(order, instances, 0, total - count);
    build(order, instances, total - count, count);
    std::vector<Instance> sorted;
    sorted.reserve(instances.size());
    for (const std::uint32_t i : order) {
        sorted.push_back(instances[i]);
    }
    instances = std::move(sorted);
    first_mirrored_ = total - count;
    spheres_.resize(total);
    refit(instances);
}

InstanceTree::Node InstanceTree::around(std::span<const Sphere> spheres) {
    const Sphere &any = spheres.front();
    glm::dvec3 low = any.center;
    glm::dvec3 high = any.center;
    Node out;
    out.least_radius_m = out.most_radius_m = any.radius_m;
    out.least_scale = out.most_scale = any.scale;
    for (const Sphere &sphere : spheres) {
        low = glm::min(low, sphere.center);
        high = glm::max(high, sphere.center);
        out.least_radius_m = std::min(out.least_radius_m, sphere.radius_m);
        out.most_radius_m = std::max(out.most_radius_m, sphere.radius_m);
        out.least_scale = std::min(out.least_scale, sphere.scale);
        out.most_scale = std::max(out.most_scale, sphere.scale);
    }
    out.center = 0.5 * (low + high);
    out.half = glm::vec3(0.5 * (high - low)) * (1.0F + widening);
    return out;
}

InstanceTree::Node InstanceTree::around(const Node &a, const Node &b) {
    const glm::dvec3 low = glm::min(a.center - glm::dvec3(a.half), b.center - glm::dvec3(b.half));
    const glm::dvec3 high = glm::max(a.center + glm::dvec3(a.half), b.center + glm::dvec3(b.half));
    Node out;
    out.center = 0.5 * (low + high);
    out.half = glm::vec3(0.5 * (high - low)) * (1.0F + widening);
    out.least_radius_m = std::min(a.least_radius_m, b.least_radius_m);
    out.most_radius_m = std::max(a.most_radius_m, b.most_radius_m);
    out.least_scale = std::min(a.least_scale, b.least_scale);
    out.most_scale = std::max(a.most_scale, b.most_scale);
    return out;
}

void InstanceTree::refit(std::span<const Instance> instances) {
    std::ranges::transform(instances, spheres_.begin(), [](const Instance &instance) {
        return Sphere{instance.center, instance.radius_m, instance.scale};
    });
    for (std::size_t at = nodes_.size(); at-- > 0;) { // children before parents
        const Node &node = nodes_[at];
        Node fitted = node.leaf ? around(std::span(spheres_).subspan(node.first, node.count))
                                : around(nodes_[at + 1], nodes_[nodes_[at + 1].next]);
        fitted.first = node.first;
        fitted.count = node.count;
        fitted.next = node.next;
        fitted.leaf = node.leaf;
        nodes_[at] = fitted;
    }
}

void InstanceTree::build(std::vector<std::uint32_t> &order, const std::vector<Instance> &instances,
                         std::uint32_t first, std::uint32_t count) {
    if (count == 0) {
        return;
    }
    const auto begin = order.begin() + first;
    Node node;
    node.first = first;
    node.count = count;
    node.leaf = count <= leaf_instances;
    const std::size_t at = nodes_.size();
    nodes_.push_back(node);
    if (!node.leaf) {
        glm::dvec3 low = instances[*begin].center;
        glm::dvec3 high = low;
        for (auto i = begin; i != begin + count; ++i) {
            low = glm::min(low, instances[*i].center);
            high = glm::max(high, instances[*i].center);
        }
        const glm::dvec3 edge = high - low;
        const int axis = edge.x >= edge.y && edge.x >= edge.z ? 0 : edge.z >= edge.y ? 2 : 1;
        const std::uint32_t half = count / 2;
        std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(instances[a].center[axis], a) < std::pair(instances[b].center[axis], b);
        });
        build(order, instances, first, half);
        build(order, instances, first + half, count - half);
    }
    nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
}

InstanceTree::Side InstanceTree::side_of(const Node &node, const View &view) {
    const glm::vec3 center = view.local(node.center);
    const float rounding_m = widening * (glm::length(center) + node.most_radius_m + 1.0F);
    bool inside = true;
    const auto is_outside = [&](const glm::vec4 &plane) {
        const float middle = glm::dot(glm::vec3(plane), center) + plane.w;
        const float extent = glm::dot(glm::abs(glm::vec3(plane)), node.half) + rounding_m;
        inside = inside && middle - extent >= -node.least_radius_m;
        return middle + extent < -node.most_radius_m;
    };
    if (std::ranges::any_of(view.planes, is_outside) || (view.clipped && is_outside(view.clip_plane))) {
        return Side::outside;
    }
    return inside ? Side::inside : Side::crossed;
}

InstanceTree::Reach InstanceTree::distances(const Node &node, const View &view, const glm::vec3 &eye) {
    const glm::vec3 away = glm::abs(eye - view.local(node.center));
    const float near = glm::length(glm::max(away - node.half, glm::vec3(0.0F)));
    const float far = glm::length(away + node.half);
    const float rounding_m = widening * (far + glm::length(eye) + node.most_radius_m);
    return {near - node.most_radius_m - rounding_m, far - node.least_radius_m + rounding_m};
}

int InstanceTree::lod_of(const Sphere &sphere, const glm::vec3 &center, const LodQuery &query) {
    return choose_lod(query, glm::distance(query.eye, center) - sphere.radius_m, sphere.scale,
                      sphere.radius_m);
}

InstanceTree::Levels InstanceTree::levels_of(const Node &node, const View &view, const LodQuery &query) {
    const Reach reach = distances(node, view, query.eye);
    const int finest =
        choose_lod(query, reach.least_m, node.most_scale * (1.0F + widening), node.most_radius_m);
    if (finest < 0) {
        return {true, finest};
    }
    const int coarsest =
        choose_lod(query, reach.most_m, node.least_scale * (1.0F - widening), node.least_radius_m);
    return {finest == coarsest, finest};
}

void InstanceTree::find_nearest(const View &view, const LodQuery &query, float near_m,
                                NearestInstance &nearest) const {
    const auto pixels_per_m = [&](float distance_m, float scale) {
        return query.pixels_at_1m * scale / std::max(distance_m, near_m);
    };
    for (std::size_t at = 0; at < nodes_.size();) {
        const Node &node = nodes_[at];
        const float least_m = distances(node, view, query.eye).least_m;
        const float scale = node.most_scale * (1.0F + widening);
        const bool may_be_nearer =
            pixels_per_m(least_m, scale) > nearest.pixels_per_m ||
            choose_lod(query.errors_m, least_m, query.pixels_at_1m * scale, query.error_px) < nearest.lod;
        const bool visit = may_be_nearer && side_of(node, view) != Side::outside;
        at = visit && !node.is_leaf() ? at + 1 : node.next;
        if (!visit || !node.is_leaf()) {
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const Sphere &sphere = spheres_[i];
            const glm::vec3 center = view.local(sphere.center);
            if (const int lod = lod_of(sphere, center, query);
                lod >= 0 && view.sees(center, sphere.radius_m)) {
                const float distance_m = glm::distance(query.eye, center) - sphere.radius_m;
                nearest.lod = std::min(nearest.lod, lod);
                nearest.pixels_per_m = std::max(nearest.pixels_per_m, pixels_per_m(distance_m, sphere.scale));
            }
        }
    }
}

float InstanceTree::largest_scale(const View &view) const {
    float largest = 0.0F;
    for (std::size_t at = 0; at < nodes_.size();) {
        const Node &node = nodes_[at];
        const Side side = node.most_scale > largest ? side_of(node, view) : Side::outside;
        at = side == Side::crossed && !node.is_leaf() ? at + 1 : node.next;
        if (side == Side::inside) {
            largest = node.most_scale;
        } else if (side == Side::crossed && node.is_leaf()) {
            for (const Sphere &sphere : std::span(spheres_).subspan(node.first, node.count)) {
                if (sphere.scale > largest && view.sees(view.local(sphere.center), sphere.radius_m)) {
                    largest = sphere.scale;
                }
            }
        }
    }
    return largest;
}

} // namespace paradize
