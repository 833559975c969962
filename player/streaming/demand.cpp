#include "streaming/demand.hpp"

#include "scene/camera.hpp"
#include "scene/cascades.hpp"
#include "streaming/terrain_cut.hpp"
#include "streaming/terrain_tiles.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

// The need that a look ahead of a steered camera found fades with each further look.
constexpr float fading = 0.9F;
constexpr double turn_s = 4.0;  // terrain that is near but in no view counts as if it were seen after this
constexpr float certain = 1e6F; // error of what must always be there: the terrain's roots
const float drawn = std::nextafter(1.0F, 2.0F); // the least error of what is drawn, or replaces what is

void raise(float &error, float to) {
    error = std::max(error, to);
}

/// The weight of an error above 1 that is seen after so many seconds.
float less_the_later(float error, double after_s) {
    return 1.0F + (error - 1.0F) * static_cast<float>(1.0 / (1.0 + after_s));
}

} // namespace

Horizons horizons_for(double read_bytes_per_s) {
    constexpr double fast_bytes_per_s = 1e8;
    constexpr double most = 4.0;
    Horizons out = near_horizons_s;
    const double times =
        read_bytes_per_s > 0.0 ? std::clamp(fast_bytes_per_s / read_bytes_per_s, 1.0, most) : 1.0;
    std::ranges::transform(out, out.begin(), [&](double s) { return s * times; });
    return out;
}

Demand::Demand(const Scene &scene, const Streamer &streamer) : scene_(scene), streamer_(streamer) {
    const assets::SceneFile &file = scene.file();
    const auto range = [&](std::string_view name) {
        const auto [first, count] = streamer.pieces_of(name);
        return Range{first, count};
    };
    sky_ = range(file.sky);
    for (const assets::DaytimeKey &key : file.daytime) {
        skies_.push_back(range(key.sky));
    }
    if (file.clouds) {
        const auto width_px = static_cast<float>(streamer.texture(file.clouds->map)->width_px());
        const float around_px = width_px * static_cast<float>(file.clouds->repeat);
        clouds_ = {range(file.clouds->map), around_px / glm::two_pi<float>()}; // at a distance of 1 m
    }
    for (const Object &object : scene.objects()) {
        ObjectUse &use = objects_.emplace_back();
        use.mesh = range(object.file->mesh);
        for (std::size_t m = 0; m < object.materials.size(); ++m) {
            const assets::Material &values = object.materials[m].values;
            const assets::MaterialMeasure &measure = object.mesh->measure(m);
            assets::for_each_map([&](assets::ObjectMap map, std::string_view) {
                if (!values.maps[map].empty()) {
                    const float uv_per_m = assets::is_second(map) ? measure.uv1_per_m : measure.uv_per_m;
                    use.maps.push_back(map_use(values.maps[map], uv_per_m));
                }
            });
            const std::string &color = values.maps[assets::ObjectMap::color];
            if (values.alpha_mode != assets::AlphaMode::opaque && !color.empty() && object.file->shadow) {
                use.holes.push_back(map_use(color, measure.uv_per_m));
            }
        }
    }
    if (file.water) {
        for (const std::string &name : {file.water->normal, file.water->dudv}) {
            water_maps_.push_back(map_use(name, file.water->wave_repeat / file.water->size_m));
        }
    }
    if (file.terrain) {
        const assets::Terrain &terrain = *file.terrain;
        const float edge_m = std::max(terrain.size_m.x, terrain.size_m.y);
        for (const std::string &name : {terrain.sand_color, terrain.sand_normal}) {
            terrain_maps_.push_back(map_use(name, terrain.sand_repeat / edge_m));
        }
        for (const std::string &name : {terrain.effect_color, terrain.effect_normal}) {
            terrain_maps_.push_back(map_use(name, 1.0F / edge_m));
        }
        for (const std::string &name : terrain.tiles) {
            const Range pieces = range(name);
            for (std::uint32_t i = pieces.first; i < pieces.first + pieces.count; ++i) {
                piece_of_patch_.insert(piece_of_patch_.end(), streamer.piece(i).levels, i);
            }
        }
        diamond_errors_.resize(terrain.diamonds.size());
        diamonds_in_view_.resize(terrain.diamonds.size());
        fading_.resize(terrain.diamonds.size());
        if (file.water) {
            fading_ = shore_diamonds(terrain, streamer, file.water->level_m);
        }
    }
    now_.resize(streamer.piece_count());
    around_.resize(now_.size());
    for (std::vector<Sighting> &sightings : soon_) {
        sightings.resize(now_.size());
    }
    seen_.resize(now_.size());
    needs_.resize(now_.size());
}

Demand::MapUse Demand::map_use(std::string_view artifact, float uv_per_m) const {
    const StreamedTexture *texture = streamer_.texture(artifact);
    if (texture == nullptr) {
        return {};
    }
    const auto [first, count] = streamer_.pieces_of(artifact);
    return {{first, count},
            uv_per_m * static_cast<float>(std::min(texture->width_px(), texture->height_px()))};
}

void Demand::update(const CameraForecast &forecast) {
    std::ranges::fill(now_, 0.0F);
    std::ranges::fill(around_, 0.0F);
    look(forecast.now, forecast.elapsed_s, forecast, now_, &around_);
    for (std::size_t i = 0; i < forecast.horizons_s.size(); ++i) {
        if (first_ || i == turn_) {
            look_ahead(i, forecast);
        }
    }
    first_ = false;
    turn_ = (turn_ + 1) % forecast.horizons_s.size();
    for (std::size_t piece = 0; piece < needs_.size(); ++piece) {
        needs_[piece] = {now_[piece], 0.0F};
        if (around_[piece] > 1.0F) {
            needs_[piece].soon = less_the_later(around_[piece], turn_s);
        }
        for (std::size_t i = 0; i < forecast.horizons_s.size(); ++i) {
            const Sighting &then = soon_[i][piece];
            if (then.error > 1.0F) { // what is accepted then is not needed; what is not, remains needed
                const double after_s = forecast.steered ? forecast.horizons_s[i]
                                                        : std::clamp(then.at_s - forecast.elapsed_s, 0.0,
                                                                     forecast.horizons_s[i]);
                raise(needs_[piece].soon, less_the_later(then.error, after_s));
            }
        }
    }
}

/// On a flight a sighting stays until its time has come, because a glimpse may fall between the horizons.
void Demand::look_ahead(std::size_t horizon, const CameraForecast &forecast) {
    const double at_s = forecast.elapsed_s + forecast.horizons_s[horizon];
    std::ranges::fill(seen_, 0.0F);
    look(forecast.soon[horizon], at_s, forecast, seen_, nullptr);
    for (std::size_t piece = 0; piece < seen_.size(); ++piece) {
        Sighting &kept = soon_[horizon][piece];
        if (forecast.steered) {
            kept.error *= fading;
        } else if (kept.at_s < forecast.elapsed_s || kept.at_s > at_s) {
            kept.error = 0.0F; // past, or of a flight that began anew
        }
        if (seen_[piece] >= kept.error) {
            kept = {seen_[piece], at_s};
        }
    }
}

void Demand::look(const Pose &pose, double elapsed_s, const CameraForecast &forecast,
                  std::vector<float> &errors, std::vector<float> *around) {
    const assets::SceneFile &file = scene_.file();
    const Daylight daylight = daylight_at(file, flight_second(elapsed_s, file.flight.duration_s));
    const Views views =
        frame_views(file, forecast.settings, pose, forecast.width_px, forecast.height_px, daylight.to_light);
    const View &main = views[static_cast<std::size_t>(ViewKind::main)];
    add_objects(views, forecast.settings, errors);
    if (file.shadow) {
        add_shadows(views, forecast.settings, errors);
    }
    add_surfaces(main, errors);
    add_sky(daylight, main.pixels_at_1m, errors);
    add_terrain(views, forecast.settings.lod_error_px, errors, around);
}

bool Demand::is_used(ViewKind view) const {
    const assets::SceneFile &file = scene_.file();
    return view == ViewKind::light ? file.shadow.has_value()
                                   : view == ViewKind::main || file.water.has_value();
}

NearestInstance Demand::nearest(const Object &object, const Views &views, float error_px) const {
    const View &main = views[static_cast<std::size_t>(ViewKind::main)];
    NearestInstance out{0.0F, static_cast<int>(object.errors_m.size())};
    for (const View &view : views) {
        if (is_used(view.kind) && drawn_in(*object.file, view.kind)) {
            const View &seen_from = view.kind == ViewKind::light ? main : view;
            object.tree.find_nearest(
                view, object.lod_query(view.kind, seen_from.eye, seen_from.pixels_at_1m, error_px),
                main.near_m, out);
        }
    }
    return out;
}

void Demand::add_objects(const Views &views, const RenderSettings &settings,
                         std::vector<float> &errors) const {
    const float accepted_px = std::max(settings.lod_error_px, 1e-3F);
    for (std::size_t i = 0; i < objects_.size(); ++i) {
        const Object &object = scene_.objects()[i];
        const NearestInstance seen = nearest(object, views, settings.lod_error_px);
        if (seen.pixels_per_m == 0.0F) {
            continue;
        }
        const Range &mesh = objects_[i].mesh;
        for (std::uint32_t piece = mesh.first; piece < mesh.first + mesh.count; ++piece) {
            const std::uint32_t level = streamer_.piece(piece).first_level;
            // Without the coarsest level the whole object is missing.
            const float error_m = level + 1 < object.file->lods.size() ? object.file->lods[level + 1].error_m
                                                                       : object.file->radius_m;
            raise(errors[piece], error_m * seen.pixels_per_m / accepted_px);
            if (seen.lod <= static_cast<int>(level)) {
                raise(errors[piece], drawn);
            }
        }
        for (const MapUse &map : objects_[i].maps) {
            add_map(map, seen.pixels_per_m * std::exp2(-settings.mip_bias), errors);
        }
    }
}

/// Holes show in the shadow as finely as the texels of the cascades that their caster stands in.
void Demand::add_shadows(const Views &views, const RenderSettings &settings,
                         std::vector<float> &errors) const {
    const assets::Shadow &shadow = *scene_.file().shadow;
    const View &light = views[static_cast<std::size_t>(ViewKind::light)];
    const View &main = views[static_cast<std::size_t>(ViewKind::main)];
    for (int cascade = 0; cascade < settings.shadow_cascades; ++cascade) {
        const View view = cascade_view(shadow, light, main, cascade);
        const float texels_per_m = std::exp2(-settings.mip_bias) / cascade_fit(shadow, light, view).w;
        for (std::size_t i = 0; i < objects_.size(); ++i) {
            const Object &object = scene_.objects()[i];
            const float scale = objects_[i].holes.empty() ? 0.0F : object.tree.largest_scale(view);
            if (scale > 0.0F) {
                for (const MapUse &map : objects_[i].holes) {
                    add_map(map, texels_per_m * scale, errors);
                }
            }
        }
    }
}

/// The error of an absent mip is the size of the next coarser texel in pixels: above 1 the mip is sampled.
void Demand::add_map(const MapUse &map, float pixels_per_m, std::vector<float> &errors) const {
    for (std::uint32_t i = map.pieces.first; i < map.pieces.first + map.pieces.count; ++i) {
        const assets::Piece &piece = streamer_.piece(i);
        const auto coarser = static_cast<int>(piece.first_level + piece.levels);
        const float texels_per_m = std::max(map.texels_per_m, 1e-6F);
        raise(errors[i], std::min(std::ldexp(pixels_per_m / texels_per_m, coarser), certain));
        if (piece.coarse) {
            raise(errors[i], drawn); // without it there is no colour at all
        }
    }
}

void Demand::add_surfaces(const View &main, std::vector<float> &errors) const {
    const assets::SceneFile &file = scene_.file();
    const double eye_m = static_cast<double>(main.eye.y) + main.anchor.y;
    const auto pixels_at = [&](double distance_m) {
        return main.pixels_at_1m / std::max(static_cast<float>(distance_m), main.near_m);
    };
    for (const MapUse &map : water_maps_) {
        add_map(map, pixels_at(std::abs(eye_m - static_cast<double>(file.water->level_m))), errors);
    }
    for (const MapUse &map : terrain_maps_) {
        add_map(map, pixels_at(eye_m - static_cast<double>(file.terrain->height_range_m.y)), errors);
    }
}

void Demand::add_sky(const Daylight &daylight, float pixels_at_1m, std::vector<float> &errors) const {
    const assets::SceneFile &file = scene_.file();
    const auto add = [&](const Range &pieces, const std::string &name) {
        if (pieces.count != 0) { // texels are largest in the middle of a face: two units wide, one unit away
            const auto edge_px = static_cast<float>(streamer_.texture(name)->width_px());
            add_map({pieces, 0.5F * edge_px}, pixels_at_1m, errors);
        }
    };
    if (file.daytime.empty()) {
        add(sky_, file.sky);
        return;
    }
    for (const std::size_t key : daylight.sky.key) {
        add(skies_[key], file.daytime[key].sky);
    }
    add_map(clouds_, pixels_at_1m, errors);
}

/// As in TerrainCut: a patch is needed if the diamond whose split shows it wants to be split. It counts as
/// seen where a patch of that split, or of a finer one, is in a view: a cut splits all diamonds above one.
void Demand::add_terrain(const Views &views, float error_px, std::vector<float> &errors,
                         std::vector<float> *around) {
    const assets::SceneFile &file = scene_.file();
    if (!file.terrain) {
        return;
    }
    const View &main = views[static_cast<std::size_t>(ViewKind::main)];
    const double water_m = file.water ? static_cast<double>(file.water->level_m) : -1e30;
    const assets::TerrainPatches &patches = file.terrain->patches;
    const assets::TerrainDiamonds &diamonds = file.terrain->diamonds;
    const glm::vec3 eye(glm::dvec3(main.eye) + main.anchor);
    const float accepted_px = std::max(error_px, 1e-3F);
    for (std::size_t d = 0; d < diamonds.size(); ++d) {
        const float distance_m = glm::distance(eye, diamonds.center[d]) - diamonds.radius_m[d];
        const float begin_px = fading_[d] ? fade_begin * accepted_px : accepted_px;
        diamond_errors_[d] =
            std::min(diamonds.error_m[d] * main.pixels_at_1m / (begin_px * std::max(main.near_m, distance_m)),
                     certain);
    }
    diamonds_in_view_.assign(diamonds.size(), false);
    for (std::size_t patch = patches.size(); patch-- > 0;) { // the finest levels first
        const std::int32_t parent = patches.parent_diamond[patch];
        if (parent < 0 || diamond_errors_[static_cast<std::size_t>(parent)] <= 1.0F ||
            diamonds_in_view_[static_cast<std::size_t>(parent)]) {
            continue;
        }
        const std::int32_t below = patches.diamond[patch];
        diamonds_in_view_[static_cast<std::size_t>(parent)] =
            (below >= 0 && diamonds_in_view_[static_cast<std::size_t>(below)]) ||
            std::ranges::any_of(views, [&](const View &view) {
                return is_used(view.kind) &&
                       patch_in_view(view, patches.center[patch], patches.radius_m[patch], water_m);
            });
    }
    for (std::size_t patch = 0; patch < patches.size(); ++patch) {
        const std::int32_t parent = patches.parent_diamond[patch];
        float &error = errors[piece_of_patch_[patch]];
        if (parent < 0) {
            raise(error, certain);
        } else if (diamonds_in_view_[static_cast<std::size_t>(parent)]) {
            raise(error, diamond_errors_[static_cast<std::size_t>(parent)]);
        } else if (around != nullptr) {
            raise((*around)[piece_of_patch_[patch]], diamond_errors_[static_cast<std::size_t>(parent)]);
        }
    }
}

} // namespace paradize
