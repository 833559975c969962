#include "streaming/terrain_tiles.hpp"

#include "gl/buffer.hpp"
#include "gl/program.hpp"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

namespace paradize {

namespace {

float above(const glm::vec4 &plane, const glm::vec3 &point) {
    return glm::dot(glm::vec3(plane), point) + plane.w;
}

constexpr double film_depth_m = 0.16; // shaders/terrain.frag and lib/light.glsl: nothing is wet below it
constexpr double rounding_m = 0.01;   // of heights, far from the origin

/// Calls use(patch, range) for each patch.
void for_each_range(const assets::TerrainPatches &patches, const Streamer &streamer, auto use) {
    std::uint32_t first = 0; // patch of the tile
    for (std::uint32_t patch = 0; patch < patches.size(); ++patch) {
        first = patch != 0 && patches.tile[patch] == patches.tile[patch - 1] ? first : patch;
        use(patch, streamer.tile(patches.tile[patch]).range(patch - first));
    }
}

} // namespace

std::vector<PatchKind> patch_heights(const assets::Terrain &terrain, const Streamer &streamer,
                                     const assets::Water &water) {
    const double water_m = water.level_m;
    const double dry_m = water_m + highest_run_up * static_cast<double>(water.swash_height_m);
    std::vector<PatchKind> out(terrain.patches.size(), PatchKind::shore);
    for_each_range(terrain.patches, streamer, [&](std::uint32_t patch, const PatchRange &range) {
        if (static_cast<double>(range.low_m) > dry_m + rounding_m) {
            out[patch] = PatchKind::dry;
        } else if (static_cast<double>(range.high_m) < water_m - film_depth_m - rounding_m) {
            out[patch] = PatchKind::sunken;
        }
    });
    return out;
}

std::vector<bool> shore_diamonds(const assets::Terrain &terrain, const Streamer &streamer, double water_m) {
    std::vector<float> low_m(terrain.diamonds.size(), std::numeric_limits<float>::max());
    std::vector<float> high_m(terrain.diamonds.size(), std::numeric_limits<float>::lowest());
    const assets::TerrainPatches &patches = terrain.patches;
    for_each_range(patches, streamer, [&](std::uint32_t patch, const PatchRange &range) {
        for (const std::int32_t diamond : {patches.parent_diamond[patch], patches.diamond[patch]}) {
            if (diamond >= 0) {
                const auto d = static_cast<std::size_t>(diamond);
                low_m[d] = std::min(low_m[d], range.low_m);
                high_m[d] = std::max(high_m[d], range.high_m);
            }
        }
    });
    std::vector<bool> out(terrain.diamonds.size());
    for (std::size_t d = 0; d < out.size(); ++d) {
        out[d] = static_cast<double>(low_m[d]) <= water_m && water_m <= static_cast<double>(high_m[d]);
    }
    return out;
}

bool patch_in_view(const View &view, const glm::dvec3 &center, float radius_m, double water_m) {
    const glm::vec3 bottom = view.local(center);
    glm::vec3 top = bottom;
    if (view.kind == ViewKind::refraction) {
        top.y = std::max(top.y, static_cast<float>(water_m - view.anchor.y));
    }
    return std::ranges::all_of(view.planes, [&](const glm::vec4 &side) {
        return above(side, bottom) >= -radius_m || above(side, top) >= -radius_m;
    });
}

TerrainTiles::TerrainTiles(const assets::Terrain &terrain, const Streamer &streamer)
    : terrain_(terrain), streamer_(streamer), cut_(terrain.patches, terrain.diamonds) {
    for (std::size_t i = 0; i < terrain.tiles.size(); ++i) {
        known_resident_.emplace_back(streamer.tile(i).blocks().size());
    }
    const std::vector<std::uint32_t> &tile = terrain.patches.tile;
    for (std::uint32_t i = 0; i <= terrain.tiles.size(); ++i) {
        first_patch_.push_back(static_cast<std::uint32_t>(std::ranges::lower_bound(tile, i) - tile.begin()));
    }
    heights_.resize(terrain.patches.size(), PatchKind::dry);
    for (std::uint32_t i = 0; i < terrain.tiles.size(); ++i) {
        same_model_.push_back(i);
        for (std::uint32_t first = 0; first < i; ++first) {
            if (streamer.tile(first).model() == streamer.tile(i).model()) {
                same_model_.back() = first;
                break;
            }
        }
    }
    low_high_m_.reserve(terrain.patches.size());
    for_each_range(terrain.patches, streamer, [&](std::uint32_t, const PatchRange &range) {
        low_high_m_.emplace_back(range.low_m, range.high_m);
    });
    seen_.reserve(terrain.patches.size());
    counts_.resize(terrain.patches.size());
    base_vertices_.resize(terrain.patches.size());
    offsets_.resize(terrain.patches.size());
    if (!terrain.light_sets.empty() && gl::has_indirect_draws()) {
        std::vector<float> numbers(std::ranges::max(terrain.light_sets) + std::size_t{1});
        std::iota(numbers.begin(), numbers.end(), 0.0F);
        set_numbers_ = gl::make_buffer(GL_ARRAY_BUFFER, numbers.size() * sizeof(float), gl::Usage::fixed);
        gl::write_buffer(GL_ARRAY_BUFFER, set_numbers_, 0, std::as_bytes(std::span(numbers)));
        indirect_ = gl::make_buffer(GL_DRAW_INDIRECT_BUFFER, sizeof(gl::IndirectDraw), gl::Usage::streamed);
        draws_.resize(terrain.patches.size());
    }
}

void TerrainTiles::set_water(const assets::Water &water) {
    water_m_ = water.level_m;
    heights_ = patch_heights(terrain_, streamer_, water);
    cut_.set_fading(shore_diamonds(terrain_, streamer_, water_m_));
}

void TerrainTiles::update(const View &main, float error_px) {
    for (std::size_t tile = 0; tile < known_resident_.size(); ++tile) {
        const std::span<const TileBlock> blocks = streamer_.tile(tile).blocks();
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            if (blocks[i].resident == known_resident_[tile][i]) {
                continue;
            }
            known_resident_[tile][i] = blocks[i].resident;
            const std::uint32_t first = first_patch_[tile] + blocks[i].first_patch;
            for (std::uint32_t patch = first; patch < first + blocks[i].patches; ++patch) {
                blocks[i].resident ? cut_.mark_resident(patch) : cut_.mark_absent(patch);
            }
        }
    }
    cut_.update({glm::vec3(glm::dvec3(main.eye) + main.anchor), main.pixels_at_1m, main.near_m, error_px});
    main_patches_ = 0;
    main_triangles_ = 0;
}

bool TerrainTiles::sees(const View &view, const glm::vec4 &plane, std::uint32_t patch) const {
    if (view.kind == ViewKind::light && !cut_.fade(patch).shows(0.5F)) {
        return false;
    }
    const float radius_m = terrain_.patches.radius_m[patch];
    if (is_beyond(view, plane, patch)) {
        return false;
    }
    return patch_in_view(view, terrain_.patches.center[patch], radius_m, water_m_);
}

bool TerrainTiles::is_beyond(const View &view, const glm::vec4 &plane, std::uint32_t patch) const {
    if (plane.x == 0.0F && plane.z == 0.0F && plane.y != 0.0F) { // level, as that of the water
        const glm::vec2 &heights_m = low_high_m_[patch];
        const double y_m = static_cast<double>(plane.y > 0.0F ? heights_m.y : heights_m.x) - view.anchor.y;
        return static_cast<double>(plane.y) * y_m + static_cast<double>(plane.w) < -rounding_m;
    }
    return above(plane, view.local(terrain_.patches.center[patch])) < -terrain_.patches.radius_m[patch];
}

PatchFade TerrainTiles::fade_in(const View &view, std::uint32_t patch) const {
    return view.kind == ViewKind::light ? PatchFade{} : cut_.fade(patch);
}

bool TerrainTiles::is_of(PatchKinds kinds, const View &view, std::uint32_t patch) const {
    const bool fades = fade_in(view, patch) != PatchFade{};
    const auto kind = static_cast<unsigned>(fades ? PatchKind::fading : heights_[patch]);
    return (kinds >> kind & 1U) != 0;
}

void TerrainTiles::choose(const View &view, const glm::vec4 &plane, PatchKinds kinds,
                          const PatchLights *lights) {
    seen_.clear();
    const std::uint32_t per_block = lights != nullptr && lights->draws_lit ? lights->sets_per_block : 0;
    for (const std::uint32_t patch : cut_.patches()) {
        const std::uint32_t set = light_set(patch);
        if (is_of(kinds, view, patch) &&
            (lights == nullptr || (lights->lit[set] != 0) == lights->draws_lit) && sees(view, plane, patch)) {
            const std::uint32_t tile_index = terrain_.patches.tile[patch];
            const StreamedTile &tile = streamer_.tile(tile_index);
            const PatchRange &range = tile.range(patch - first_patch_[tile_index]);
            seen_.push_back({patch, same_model_[tile_index], per_block != 0 ? set / per_block : 0,
                             per_block != 0 ? set % per_block : 0, fade_in(view, patch),
                             &tile.blocks()[range.block].slot, &range});
        }
    }
    // Those that one call draws lie together. Of them the last patch is the first: fine patches are near and
    // hide coarse ones behind them.
    std::ranges::sort(seen_, [&](const VisiblePatch &a, const VisiblePatch &b) {
        const auto set = [&](const VisiblePatch &one) { return indirect_ ? 0 : one.light_set; };
        return std::tuple(a.slot->page->id, a.model, a.light_block, set(a), a.fade.from, -a.fade.to,
                          b.patch) <
               std::tuple(b.slot->page->id, b.model, b.light_block, set(b), b.fade.from, -b.fade.to, a.patch);
    });
}

bool TerrainTiles::joined(const VisiblePatch &a, const VisiblePatch &b) const {
    return a.slot->page == b.slot->page && a.model == b.model && a.light_block == b.light_block &&
           (indirect_ || a.light_set == b.light_set) && a.fade == b.fade;
}

void TerrainTiles::draw_by_lights(std::span<const VisiblePatch> patches) {
    const GeometryPage &page = *patches.front().slot->page;
    gl::attribute_floats(gl::attribute_free, 1, set_numbers_, sizeof(float), 0, 1);
    std::ranges::transform(patches, draws_.begin(), [](const VisiblePatch &one) {
        return gl::IndirectDraw{static_cast<std::uint32_t>(one.range->index_count), 1,
                                static_cast<std::uint32_t>(one.slot->first_index + one.range->first_index),
                                static_cast<std::int32_t>(one.slot->first_vertex + one.range->first_vertex),
                                one.light_set};
    });
    gl::replace_buffer(GL_DRAW_INDIRECT_BUFFER, indirect_,
                       std::as_bytes(std::span(draws_).first(patches.size())));
    gl::draw_indirect(page.layout.index_type(), 0, patches.size());
}

void TerrainTiles::draw(const View &view, const TerrainUniforms &uniforms, const PatchLights *lights) {
    const bool lit = lights != nullptr && lights->draws_lit;
    std::uint64_t triangles = 0;
    const VisiblePatch *before = nullptr; // of the last draw call
    for (std::size_t begin = 0; begin < seen_.size();) {
        const VisiblePatch &first = seen_[begin];
        const std::size_t from = begin;
        const GeometryPage &page = *first.slot->page;
        if (before == nullptr || before->model != first.model) {
            const glm::dmat4 &model = streamer_.tile(first.model).model();
            gl::Program::set(uniforms.model, view.local(model));
            gl::Program::set(uniforms.normals, glm::mat3(glm::transpose(glm::inverse(glm::dmat3(model)))));
        }
        if (before == nullptr || before->slot->page != &page) {
            glBindVertexArray(page.vertex_array.name());
        }
        if (lit && (before == nullptr || before->light_block != first.light_block)) {
            lights->bind_block(first.light_block);
        }
        std::size_t count = 0;
        for (; begin < seen_.size() && joined(first, seen_[begin]); ++begin, ++count) {
            const VisiblePatch &seen = seen_[begin];
            counts_[count] = seen.range->index_count;
            base_vertices_[count] = static_cast<int>(seen.slot->first_vertex + seen.range->first_vertex);
            offsets_[count] = reinterpret_cast<const void *>(
                (seen.slot->first_index + seen.range->first_index) * page.layout.index_bytes);
            triangles += static_cast<std::uint64_t>(seen.range->index_count) / 3;
        }
        gl::Program::set(uniforms.fade, glm::vec2(first.fade.from, first.fade.to));
        if (lit && indirect_) {
            draw_by_lights(std::span(seen_).subspan(from, count));
        } else {
            glVertexAttrib1f(gl::attribute_free, static_cast<float>(first.light_set));
            gl::draw_triangle_ranges(std::span(counts_).first(count), page.layout.index_type(),
                                     std::span(offsets_).first(count),
                                     std::span(base_vertices_).first(count));
        }
        before = &first;
    }
    if (view.kind == ViewKind::main) {
        main_patches_ += static_cast<std::uint32_t>(seen_.size());
        main_triangles_ += triangles;
    }
}

TerrainCounts TerrainTiles::counts() const {
    TerrainCounts out;
    out.patches = main_patches_;
    out.triangles = main_triangles_;
    out.cut_patches = static_cast<std::uint32_t>(cut_.patches().size());
    for (const std::uint32_t patch : cut_.patches()) {
        const std::uint32_t tile = terrain_.patches.tile[patch];
        out.cut_triangles += static_cast<std::uint64_t>(
            streamer_.tile(tile).range(patch - first_patch_[tile]).index_count / 3);
    }
    out.resident_patches = cut_.resident_count();
    out.total_patches = static_cast<std::uint32_t>(terrain_.patches.size());
    return out;
}

} // namespace paradize
