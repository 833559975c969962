#include "passes/draw_list.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <tuple>

namespace paradize {

using assets::AlphaMode;

namespace {

std::uint32_t page_of(const DrawCommand &command) {
    return command.object->mesh != nullptr ? command.object->mesh->page(command.lod).id : 0;
}

} // namespace

InstanceTransforms::InstanceTransforms(std::span<const Object> objects)
    : objects_(objects), anchor_(std::numeric_limits<double>::quiet_NaN()) {
    std::uint32_t count = 0;
    for (const Object &object : objects) {
        first_.push_back(count);
        count += static_cast<std::uint32_t>(object.instances.size());
    }
    rows_.resize(count);
}

void InstanceTransforms::update(const glm::dvec3 &anchor) {
    const bool stays = anchor == anchor_;
    anchor_ = anchor;
    for (std::size_t i = 0; i < objects_.size(); ++i) {
        if (stays && !objects_[i].moves()) {
            continue;
        }
        const std::span<const Instance> instances = objects_[i].instances;
        find_rows(instances, anchor, std::span(rows_).subspan(first_[i], instances.size()));
    }
}

std::span<const InstanceRows> InstanceTransforms::of(const DrawItem &item) const {
    const auto object = static_cast<std::size_t>(item.object - objects_.data());
    return std::span(rows_).subspan(first_[object] + item.first, item.count);
}

DrawList::DrawList(std::span<const Object> objects, DrawnMaterials drawn) : objects_(objects), drawn_(drawn) {
    std::size_t most_commands = 0;
    std::size_t most_blended = 0;
    for (const Object &object : objects) {
        const auto materials = static_cast<std::size_t>(
            std::ranges::count_if(object.materials, [&](const Material &one) { return has(one); }));
        const std::size_t sets = object.light_sets.size();
        const std::size_t groups = 2 * sets * std::max<std::size_t>(object.errors_m.size(), 1);
        first_group_.push_back(static_cast<std::uint32_t>(groups_.size()));
        first_light_.push_back(static_cast<std::uint32_t>(light_as_.size()));
        light_as_.resize(light_as_.size() + sets);
        for (std::size_t group = 0; group < groups; ++group) {
            const std::size_t of_level = group % (2 * sets);
            groups_.push_back({&object, static_cast<int>(group / (2 * sets)), of_level >= sets,
                               object.light_sets[of_level % sets]});
        }
        most_commands += materials * std::min(groups, object.instances.size());
        most_blended += materials * object.instances.size();
    }
    const bool is_blended = drawn == DrawnMaterials::blended;
    blended_.reserve(is_blended ? most_blended : 0);
    commands_.reserve(is_blended ? most_blended : most_commands);
}

bool DrawList::has(const Material &material) const {
    const bool is_blended = material.values.alpha_mode == AlphaMode::blend;
    return drawn_ == DrawnMaterials::all || is_blended == (drawn_ == DrawnMaterials::blended);
}

void DrawList::fill(std::span<const DrawItem> items, const View &view, const InstanceTransforms &transforms,
                    std::span<const std::uint32_t> lit) {
    items_ = items;
    transforms_ = &transforms;
    lit_ = lit;
    if (!lit_.empty()) {
        find_lights();
    }
    commands_.clear();
    if (drawn_ == DrawnMaterials::blended) {
        fill_blended(view);
        instance_count_ = blended_.size();
    } else {
        fill_sorted();
    }
}

void DrawList::find_lights() {
    for (const Object &object : objects_) {
        const std::span<const std::uint32_t> sets = object.light_sets; // the first is 0
        for (std::uint32_t i = 0; i < sets.size(); ++i) {
            std::uint32_t first = 0;
            while (drawn_set(sets[first]) != drawn_set(sets[i])) {
                ++first;
            }
            light_as_[first_light_[index_of(object)] + i] = first;
        }
    }
}

DrawList::Group &DrawList::group_of(const DrawItem &item, std::uint32_t light) {
    const std::size_t side = 2 * static_cast<std::size_t>(item.lod) + (item.mirrored ? 1U : 0U);
    return groups_[first_group_[index_of(*item.object)] + side * item.object->light_sets.size() + light];
}

template <class Take>
void DrawList::for_each_part(const DrawItem &item, const Take &take) {
    const std::span<const Instance> instances = item.instances();
    if (lit_.empty() || item.object->light_sets.size() == 1) {
        take(group_of(item, 0), 0U, item.count);
        return;
    }
    for (std::uint32_t begin = 0, end = 0; begin < item.count; begin = end) {
        const std::uint32_t light = light_of(*item.object, instances[begin]);
        for (end = begin + 1; end < item.count && light_of(*item.object, instances[end]) == light; ++end) {
        }
        take(group_of(item, light), begin, end - begin);
    }
}

bool DrawList::is_drawn(const DrawItem &item) const {
    return std::ranges::any_of(item.object->materials, [&](const Material &one) { return has(one); });
}

void DrawList::write_instances(std::span<InstanceRows> rows) {
    if (drawn_ == DrawnMaterials::blended) {
        std::ranges::transform(blended_, rows.begin(), [&](const Blended &one) {
            return transforms_->of(items_[one.item])[one.instance];
        });
        return;
    }
    for (Group &group : groups_) {
        group.filled = 0;
    }
    for (const DrawItem &item : items_) {
        if (is_drawn(item)) {
            for_each_part(item, [&](Group &group, std::uint32_t first, std::uint32_t count) {
                std::ranges::copy(transforms_->of(item).subspan(first, count),
                                  rows.begin() + group.first + group.filled);
                group.filled += count;
            });
        }
    }
}

void DrawList::fill_sorted() {
    for (Group &group : groups_) {
        group.count = 0;
    }
    for (const DrawItem &item : items_) {
        if (is_drawn(item)) {
            for_each_part(item,
                          [](Group &group, std::uint32_t, std::uint32_t count) { group.count += count; });
        }
    }
    std::uint32_t total = 0;
    for (Group &group : groups_) {
        group.first = total;
        total += group.count;
        for (std::uint32_t m = 0; group.count != 0 && m < group.object->materials.size(); ++m) {
            if (has(group.object->materials[m])) {
                commands_.push_back({group.object, m, group.lod, group.mirrored, group.first, group.count,
                                     drawn_set(group.light_set)});
            }
        }
    }
    instance_count_ = total;
    const bool casts = drawn_ == DrawnMaterials::all;
    std::ranges::sort(commands_, {}, [&](const DrawCommand &command) {
        const Material &material = command.object->materials[command.material];
        const assets::Material &values = material.values;
        return std::tuple(values.alpha_mode, !casts && values.vertex_colors, values.sways(), values.beats,
                          !casts && command.object->dry, command.light_set != 0,
                          casts ? material.shadow_id : material.id, command.light_set, command.mirrored,
                          page_of(command), index_of(*command.object), command.lod, command.material);
    });
}

void DrawList::fill_blended(const View &view) {
    blended_.clear();
    for (std::uint32_t i = 0; i < items_.size(); ++i) {
        const Object &object = *items_[i].object;
        for (std::uint32_t m = 0; m < object.materials.size(); ++m) {
            if (!has(object.materials[m])) {
                continue;
            }
            const glm::dvec4 center(object.materials[m].center, 1.0);
            for (std::uint32_t n = 0; n < items_[i].count; ++n) {
                const glm::dvec3 place(items_[i].instances()[n].model * center);
                blended_.push_back({i, n, m, glm::distance(view.local(place), view.eye)});
            }
        }
    }
    std::ranges::sort(blended_, [](const Blended &a, const Blended &b) {
        return std::tuple(-a.distance, a.item, a.instance, a.material) <
               std::tuple(-b.distance, b.item, b.instance, b.material);
    });
    for (std::uint32_t first = 0; first < blended_.size(); ++first) {
        const Blended &one = blended_[first];
        const DrawItem &item = items_[one.item];
        const std::uint32_t light_set =
            drawn_set(item.object->light_sets[item.instances()[one.instance].light]);
        // Instances of a draw call are drawn in their order. Two-sided materials take two calls each.
        if (!commands_.empty()) {
            DrawCommand &last = commands_.back();
            if (last.object == item.object && last.material == one.material && last.lod == item.lod &&
                last.light_set == light_set && last.mirrored == item.mirrored &&
                !item.object->materials[one.material].values.two_sided) {
                ++last.count;
                continue;
            }
        }
        commands_.push_back({item.object, one.material, item.lod, item.mirrored, first, 1, light_set});
    }
}

} // namespace paradize
