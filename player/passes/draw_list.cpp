#include "passes/draw_list.hpp"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <numeric>
#include <tuple>

namespace paradize {

using assets::AlphaMode;

DrawList::DrawList(std::span<const Object> objects, DrawnMaterials drawn) : objects_(objects), drawn_(drawn) {
    std::size_t most_items = 0;
    std::size_t most_instances = 0;
    for (const Object &object : objects) {
        const auto materials = static_cast<std::size_t>(
            std::ranges::count_if(object.materials, [&](const Material &one) { return has(one); }));
        most_items += object.instances.size();
        most_commands_ += materials * object.instances.size();
        most_instances += (drawn == DrawnMaterials::blended ? materials : 1) * object.instances.size();
    }
    order_.reserve(most_items);
    blended_.reserve(drawn == DrawnMaterials::blended ? most_commands_ : 0);
    commands_.reserve(most_commands_);
    instances_.reserve(most_instances);
}

bool DrawList::has(const Material &material) const {
    const bool is_blended = material.values.alpha_mode == AlphaMode::blend;
    return drawn_ == DrawnMaterials::all || is_blended == (drawn_ == DrawnMaterials::blended);
}

void DrawList::add_instance(const DrawItem &item, const View &view) {
    const glm::mat4 rows = glm::transpose(view.local(item.instance->model));
    instances_.push_back({rows[0], rows[1], rows[2]});
}

void DrawList::fill(std::span<const DrawItem> items, const View &view) {
    commands_.clear();
    instances_.clear();
    if (drawn_ == DrawnMaterials::blended) {
        fill_blended(items, view);
    } else {
        fill_sorted(items, view);
    }
}

void DrawList::fill_sorted(std::span<const DrawItem> items, const View &view) {
    const auto group = [&](std::uint32_t i) {
        const DrawItem &item = items[i];
        return std::tuple(index_of(*item.object), item.lod, item.instance->mirrored);
    };
    order_.resize(items.size());
    std::iota(order_.begin(), order_.end(), 0U);
    std::ranges::sort(order_, [&](std::uint32_t a, std::uint32_t b) {
        return std::tuple(group(a), a) < std::tuple(group(b), b);
    });
    for (std::size_t start = 0; start < order_.size();) {
        const auto first = static_cast<std::uint32_t>(instances_.size());
        const DrawItem &item = items[order_[start]];
        const auto same = group(order_[start]);
        for (; start < order_.size() && group(order_[start]) == same; ++start) {
            add_instance(items[order_[start]], view);
        }
        const auto count = static_cast<std::uint32_t>(instances_.size()) - first;
        for (std::uint32_t m = 0; m < item.object->materials.size(); ++m) {
            if (has(item.object->materials[m])) {
                commands_.push_back({item.object, m, item.lod, item.instance->mirrored, first, count});
            }
        }
    }
    std::ranges::sort(commands_, {}, [&](const DrawCommand &command) {
        const Material &material = command.object->materials[command.material];
        return std::tuple(material.values.alpha_mode, material.values.vertex_colors, material.id,
                          index_of(*command.object), command.lod, command.mirrored, command.material);
    });
}

void DrawList::fill_blended(std::span<const DrawItem> items, const View &view) {
    blended_.clear();
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const Object &object = *items[i].object;
        for (std::uint32_t m = 0; m < object.materials.size(); ++m) {
            if (has(object.materials[m])) {
                const glm::dvec4 center(object.materials[m].center, 1.0F);
                const glm::vec3 place = view.local(glm::dvec3(items[i].instance->model * center));
                blended_.push_back({i, m, glm::distance(place, view.eye)});
            }
        }
    }
    std::ranges::sort(blended_, [](const Blended &a, const Blended &b) {
        return std::tuple(-a.distance, a.item, a.material) < std::tuple(-b.distance, b.item, b.material);
    });
    for (const Blended &one : blended_) {
        const DrawItem &item = items[one.item];
        const auto first = static_cast<std::uint32_t>(instances_.size());
        add_instance(item, view);
        // Instances of a draw call are drawn in their order. Two-sided materials take two calls each.
        if (!commands_.empty()) {
            DrawCommand &last = commands_.back();
            if (last.object == item.object && last.material == one.material && last.lod == item.lod &&
                last.mirrored == item.instance->mirrored &&
                !item.object->materials[one.material].values.two_sided) {
                ++last.count;
                continue;
            }
        }
        commands_.push_back({item.object, one.material, item.lod, item.instance->mirrored, first, 1});
    }
}

} // namespace paradize
