#pragma once
// One scene folder that is played: its frames, its screenshots and what --json reports of them.

#include "app/options.hpp"
#include "app/progress.hpp"
#include "app/rate_control.hpp"
#include "app/report.hpp"
#include "app/scene_swap.hpp"
#include "gl/shader_library.hpp"
#include "gl/timestamp.hpp"
#include "render/renderer.hpp"
#include "scene/bake_limits.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace paradize {

namespace gl {
class DebugLog;
}
class Window;

inline constexpr double frame_s = 1.0 / 30.0; // between two frames of --frames

MemoryLimits memory_limits(const Options &options);
/// The settings that the options ask for. Needs a GL context.
RenderSettings chosen_settings(const Options &options, const assets::SceneFile &file);

/// The budget for the uploads of a frame. `first`: nothing was uploaded before.
UploadBudget frame_budget(bool first, bool headless, UploadOrder order);

using PosesAhead = decltype(CameraForecast::soon);
/// Where a camera is after horizons_s if it goes on as since the last frame, `delta_s` ago; it keeps its view
/// direction.
PosesAhead poses_ahead(const Pose &pose, const Pose &before, double delta_s, const Horizons &horizons_s);

/// Lives as long as the GL context.
class Playback {
  public:
    /// `watcher` supplies scenes that replace the first one. nullptr: the scene is never replaced.
    /// `started_ms`: when the player was started.
    Playback(const Options &options, PendingScene pending, const RendererOptions &renderer_options,
             assets::SceneWatcher *watcher, double started_ms);

    const assets::SceneFile &file() const { return scenes_.current().file; }
    Renderer &renderer() { return *renderer_; }

    /// Where the flight leads from this time on.
    CameraForecast flight_forecast(double elapsed_s) const;
    /// Where a steered camera heads, if it goes on as since the last frame.
    CameraForecast steered_forecast(const Pose &pose, const Pose &before, double elapsed_s,
                                    double delta_s) const;
    /// Warns once if the free camera leaves the region that the scene was baked for.
    void check_free_camera(const glm::dvec3 &eye);

    /// Uploads within the budget of a frame and draws.
    void frame(double elapsed_s, const CameraForecast &forecast, gl::DebugLog &log);
    /// Frames to record. Their recording allocates nothing. Without a window it is said how far they are.
    void reserve_frames(std::size_t frames);
    /// Records the duration of a finished frame, and adjusts the quality for --fps.
    void record_frame_time(double ms);
    void measure_passes(double elapsed_s);
    /// Waits until all files of the scene are checked. Throws Error if one is damaged.
    void finish_checks() { scenes_.current().streamer.finish_checks(); }
    /// Writes the picture as PNG.
    void save(const std::filesystem::path &path);
    /// Shows in the window's title how streaming stands; at most once a second, because it allocates.
    void show_panel(Window &window, double now_s);
    Report report() const;

  private:
    Horizons horizons_s() const;
    CameraForecast flight_forecast(double elapsed_s, int width_px, int height_px) const;
    void apply(const Quality &quality);
    void warn_of_terrain_size() const;
    /// Says now and then how far the frames are.
    void tell_progress();
    /// Warns once if the picture needs more than the limit of device memory.
    void warn_of_memory_limit(double elapsed_s);
    /// Replaces the scene by `next`. Playback time and camera stay.
    void activate(LoadedScene &next, double elapsed_s);

    const Options &options_;
    const double started_ms_;
    RendererOptions renderer_options_;
    SceneSwap scenes_;
    bool warned_of_memory_ = false;
    std::unique_ptr<BakeLimits> bake_limits_ = std::make_unique<BakeLimits>(file());
    gl::ShaderLibrary shaders_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<Sample> samples_;             // of --reference, otherwise empty
    std::optional<Progress> progress_;        // of --headless
    std::vector<double> frame_ms_, scene_ms_; // one entry per frame
    std::uint64_t most_draw_calls_ = 0;       // of a frame
    std::vector<StreamingMoment> moments_;
    double stream_ms_ = 0.0; // of the last frame
    double panel_s_ = 0.0;   // when the panel is written again
    std::vector<std::uint8_t> pixels_;
    std::vector<std::string> screenshots_;
    const Device device_;
    const std::vector<QualityFeature> features_; // that the scene and the device have
    std::optional<RateControl> rate_;            // of --fps
    std::vector<std::pair<std::string, double>> passes_ms_;
    MeterClock meter_clock_ = gl::has_timestamps() ? MeterClock::device : MeterClock::processor;
};

} // namespace paradize
