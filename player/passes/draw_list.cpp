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

bool InstanceTransforms::update(const glm::dvec3 &anchor) {
    const bool stays = anchor == anchor_;
    anchor_ = anchor;
    for (std::size_t i = 0; i < objects_.size(); ++i) {
        if (stays && !objects_[i].moves()) {
            continue;
        }
        const std::span<const Instance> instances = objects_[i].instances;
        find_rows(instances, anchor, std::span(rows_).subspan(first_[i], instances.size()));
    }
    return !stays;
}

DrawList::DrawList(std::span<const Object> objects, DrawnMaterials drawn, std::uint32_t sets_per_block)
    : objects_(objects), drawn_(drawn), sets_per_block_(sets_per_block) {
    std::size_t most_commands = 0;
    std::size_t most_blended = 0;
    std::size_t most_ranges = 0;
    for (const Object &object : objects) {
        const auto materials = static_cast<std::size_t>(
            std::ranges::count_if(object.materials, [&](const Material &one) { return has(one); }));
        const std::size_t blocks = std::ranges::max(object.light_sets) / sets_per_block_ + 1;
        const std::size_t groups = 2 * blocks * std::max<std::size_t>(object.errors_m.size(), 1);
        first_group_.push_back(static_cast<std::uint32_t>(groups_.size()));
        for (std::size_t group = 0; group < groups; ++group) {
            groups_.push_back({&object, static_cast<int>(group / (2 * blocks)), group / blocks % 2 == 1,
                               static_cast<std::uint32_t>(group % blocks)});
        }
        most_commands += materials * std::min(groups, object.instances.size());
        most_blended += materials * object.instances.size();
        most_ranges += object.instances.size();
    }
    first_group_.push_back(static_cast<std::uint32_t>(groups_.size()));
    const bool is_blended = drawn == DrawnMaterials::blended;
    blended_.reserve(is_blended ? most_blended : 0);
    ranges_.reserve(is_blended ? most_blended : most_ranges);
    commands_.reserve(is_blended ? most_blended : most_commands);
}

bool DrawList::has(const Material &material) const {
    const bool is_blended = material.values.alpha_mode == AlphaMode::blend;
    return drawn_ == DrawnMaterials::all || is_blended == (drawn_ == DrawnMaterials::blended);
}

void DrawList::fill(std::span<const DrawItem> items, const View &view, const InstanceTransforms &transforms,
                    std::span<const std::uint8_t> lit) {
    items_ = items;
    transforms_ = &transforms;
    lit_ = lit;
    commands_.clear();
    ranges_.clear();
    if (drawn_ == DrawnMaterials::blended) {
        fill_blended(view);
    } else {
        fill_sorted();
    }
}

bool DrawList::is_lit(const Object &object) const {
    return !lit_.empty() &&
           std::ranges::any_of(object.light_sets, [&](std::uint32_t set) { return lit_[set] != 0; });
}

template <class Take>
void DrawList::for_each_part(const DrawItem &item, const Take &take) {
    const std::size_t object = index_of(*item.object);
    const std::size_t groups = first_group_[object + 1] - first_group_[object];
    const std::size_t blocks = groups / (2 * std::max<std::size_t>(item.object->errors_m.size(), 1));
    const std::size_t side = 2 * static_cast<std::size_t>(item.lod) + (item.mirrored ? 1U : 0U);
    Group *const of_blocks = &groups_[first_group_[object] + side * blocks];
    if (blocks == 1 || !is_lit(*item.object)) {
        take(of_blocks[0], item.first, item.count);
        return;
    }
    const std::uint32_t last = item.first + item.count;
    for (std::uint32_t begin = item.first, end = 0; begin < last; begin = end) {
        const std::uint32_t block = block_of(*item.object, item.object->instances[begin]);
        for (end = begin + 1; end < last && block_of(*item.object, item.object->instances[end]) == block;
             ++end) {
        }
        take(of_blocks[block], begin, end - begin);
    }
}

bool DrawList::is_drawn(const DrawItem &item) const {
    return std::ranges::any_of(item.object->materials, [&](const Material &one) { return has(one); });
}

void DrawList::write_instances(std::span<const InstanceRows> rows, std::span<InstanceRows> out) const {
    auto to = out.begin();
    for (const RowRange &range : ranges_) {
        to = std::ranges::copy(rows.subspan(range.first, range.count), to).out;
    }
}

void DrawList::fill_sorted() {
    for (Group &group : groups_) {
        group.count = group.ranges = 0;
    }
    for (const DrawItem &item : items_) {
        if (is_drawn(item)) {
            for_each_part(item, [](Group &group, std::uint32_t, std::uint32_t count) {
                group.count += count;
                ++group.ranges;
            });
        }
    }
    std::uint32_t instances = 0;
    std::uint32_t ranges = 0;
    for (Group &group : groups_) {
        const Object &object = *group.object;
        for (std::uint32_t m = 0; group.count != 0 && m < object.materials.size(); ++m) {
            if (has(object.materials[m])) {
                commands_.push_back({&object, m, group.lod, group.mirrored, is_lit(object), group.light_block,
                                     instances, group.count, ranges, group.ranges});
            }
        }
        group.end = ranges;
        instances += group.count;
        ranges += group.ranges;
    }
    instance_count_ = instances;
    ranges_.resize(ranges);
    for (const DrawItem &item : items_) {
        if (is_drawn(item)) {
            const std::uint32_t row = transforms_->first_of(*item.object);
            for_each_part(item, [&](Group &group, std::uint32_t first, std::uint32_t count) {
                ranges_[group.end++] = {row + first, count};
            });
        }
    }
    const bool casts = drawn_ == DrawnMaterials::all;
    std::ranges::sort(commands_, {}, [&](const DrawCommand &command) {
        const Material &material = command.object->materials[command.material];
        const assets::Material &values = material.values;
        return std::tuple(values.alpha_mode, !casts && values.vertex_colors, values.sways(), values.beats,
                          !casts && command.object->dry, command.by_lights,
                          casts ? material.shadow_id : material.id, command.light_block, command.mirrored,
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
    instance_count_ = blended_.size();
    for (std::uint32_t first = 0; first < blended_.size(); ++first) {
        const Blended &one = blended_[first];
        const DrawItem &item = items_[one.item];
        const Object &object = *item.object;
        const bool by_lights = is_lit(object);
        const std::uint32_t block = by_lights ? block_of(object, item.instances()[one.instance]) : 0;
        ranges_.push_back({transforms_->first_of(object) + item.first + one.instance, 1});
        // Instances of a draw call are drawn in their order. Two-sided materials take two calls each.
        if (!commands_.empty()) {
            DrawCommand &last = commands_.back();
            if (last.object == &object && last.material == one.material && last.lod == item.lod &&
                last.light_block == block && last.mirrored == item.mirrored &&
                !object.materials[one.material].values.two_sided) {
                ++last.count;
                ++last.range_count;
                continue;
            }
        }
        commands_.push_back(
            {&object, one.material, item.lod, item.mirrored, by_lights, block, first, 1, first, 1});
    }
}

} // namespace paradize
