#pragma once
// How much each piece of a scene is needed: the error on screen while it is absent, now and along the way in
// the seconds to come. Uses no GL.

#include "scene/daylight.hpp"
#include "scene/flight.hpp"
#include "scene/quality.hpp"
#include "streaming/scene.hpp"
#include "streaming/schedule.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace paradize {

/// Seconds ahead that the demand looks at.
using Horizons = std::array<double, 4>;
inline constexpr Horizons near_horizons_s{1.0, 2.0, 4.0, 8.0};
/// Looks further ahead where files are read slowly: up to four times as far as near_horizons_s, which are
/// those of 100 MB/s and more, and of a rate that is not known yet (0).
Horizons horizons_for(double read_bytes_per_s);

/// Where the camera is and will be.
struct CameraForecast {
    RenderSettings settings{};
    int width_px = 0, height_px = 0;
    Pose now{};
    std::array<Pose, near_horizons_s.size()> soon{}; // after horizons_s
    double elapsed_s = 0.0;                          // playback time of now
    bool steered = false;                            // the later poses are guesses
    Horizons horizons_s = near_horizons_s;
};

class Demand {
  public:
    /// Both must outlive this object.
    Demand(const Scene &scene, const Streamer &streamer);

    /// Looks at the pose of now and at one of the later poses in turn; the first call looks at all. An error
    /// after s seconds counts 1 / (1 + s). Allocates nothing.
    void update(const CameraForecast &forecast);
    /// One entry per piece of the streamer.
    std::span<const Need> needs() const { return needs_; }

  private:
    struct Range {
        std::uint32_t first = 0, count = 0; // pieces of an artifact
    };
    struct MapUse {
        Range pieces;
        float texels_per_m = 0.0F; // of mip 0, where they are stretched
    };
    struct ObjectUse {
        Range mesh;
        std::vector<MapUse> maps;
        std::vector<MapUse> holes; // colour maps whose alpha shapes the object's shadow
    };
    /// The largest error that a look ahead has seen, and when that will be.
    struct Sighting {
        float error = 0.0F;
        double at_s = 0.0;
    };
    using Views = std::array<View, view_kinds>;

    void look_ahead(std::size_t horizon, const CameraForecast &forecast);
    MapUse map_use(std::string_view artifact, float uv_per_m) const;
    /// Raises `errors` to those that the pose sees, and `around` to those of terrain that it would see where
    /// it turned; nullptr: not asked for.
    void look(const Pose &pose, double elapsed_s, const CameraForecast &forecast, std::vector<float> &errors,
              std::vector<float> *around);
    bool is_used(ViewKind view) const;
    NearestInstance nearest(const Object &object, const Views &views, float error_px) const;
    void add_objects(const Views &views, const RenderSettings &settings, std::vector<float> &errors) const;
    void add_shadows(const Views &views, const RenderSettings &settings, std::vector<float> &errors) const;
    void add_map(const MapUse &map, float pixels_per_m, std::vector<float> &errors) const;
    void add_surfaces(const View &main, std::vector<float> &errors) const;
    void add_sky(const Daylight &daylight, float pixels_at_1m, std::vector<float> &errors) const;
    void add_terrain(const Views &views, float error_px, std::vector<float> &errors,
                     std::vector<float> *around);

    const Scene &scene_;
    const Streamer &streamer_;
    std::vector<ObjectUse> objects_; // as in the scene
    std::vector<MapUse> terrain_maps_, water_maps_;
    Range sky_;
    std::vector<Range> skies_; // of the scene's keys
    MapUse clouds_;
    std::vector<std::uint32_t> piece_of_patch_; // of the terrain
    std::vector<bool> fading_;                  // per diamond of the terrain, as in the cut
    std::vector<float> diamond_errors_;
    std::vector<bool> diamonds_in_view_;
    std::vector<float> now_, around_;
    std::array<std::vector<Sighting>, near_horizons_s.size()> soon_; // per horizon and piece
    std::vector<float> seen_;                                        // of one look
    std::vector<Need> needs_;
    std::size_t turn_ = 0;
    bool first_ = true;
};

} // namespace paradize
