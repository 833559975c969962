#pragma once
// Draws frames: sets the views, runs the passes, resolves the picture.

#include "passes/frame.hpp"
#include "passes/pass.hpp"
#include "passes/pass_meter.hpp"
#include "render/main_target.hpp"
#include "render/samples.hpp"
#include "scene/flight.hpp"
#include "scene/quality.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace paradize {

struct RendererOptions {
    int width_px = 0;
    int height_px = 0;
    RenderSettings settings;
    std::vector<std::string> disabled; // names of passes
};

/// A pixel of the drawn picture with a value that is not finite.
struct BadPixel {
    int x = 0, y = 0; // from the top left
    float value[4] = {};
};

class Renderer {
  public:
    /// Builds the passes. Throws Error.
    Renderer(Scene &scene, const gl::ShaderLibrary &shaders, const RendererOptions &options);
    ~Renderer();
    Renderer(const Renderer &) = delete;
    Renderer &operator=(const Renderer &) = delete;

    void resize(int width_px, int height_px);
    /// Continues the clock of another renderer after its last frame.
    void continue_from(const Renderer &before);
    /// Takes effect with the next frame. Passes that cannot be reused with these settings are taken from a
    /// cache or built.
    void change_settings(const RenderSettings &settings);
    /// Draws the frame at playback time `elapsed_s`, seen from `pose`.
    void draw(double elapsed_s, const Pose &pose);
    /// Draws the mean of several frames in linear light. Each sample has its own place inside the pixel and
    /// its own point on the sun's disc. Exposure and all later steps follow the mean. `drawn` is called after
    /// each.
    void draw_mean(double elapsed_s, const Pose &pose, const std::vector<Sample> &samples,
                   const std::function<void()> &drawn);
    /// Draws one frame and measures it. Returns name and milliseconds of each pass in drawing order, and of
    /// what lies between them: "views" (choosing what to draw), "clear" and "resolve" of the main view's
    /// target.
    std::vector<std::pair<std::string_view, double>> measure_passes(double elapsed_s, const Pose &pose,
                                                                    MeterClock clock);

    /// Terrain counts of the last frame. Empty if the scene has no terrain.
    std::optional<TerrainCounts> terrain_counts() const;
    /// Draw calls of the last frame, in all its views.
    std::uint64_t draw_calls() const { return draw_calls_; }
    /// Processor time of the last frame for culling, levels of detail, the terrain's cut and draw lists.
    double scene_ms() const { return frame_.scene_ms; }

    /// Framebuffer of the finished 8-bit picture.
    unsigned output() const;
    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    /// Reads the finished picture as RGB, first row at the top. Resizes `pixels`.
    void read_picture(std::vector<std::uint8_t> &pixels) const;
    /// Finds the first pixel of the linear picture that holds a NaN or an infinity.
    std::optional<BadPixel> find_bad_pixel() const;

  private:
    /// The resolved picture; filters draw from one into the other.
    struct Picture {
        gl::Texture color;
        gl::Framebuffer framebuffer;
    };

    void begin_frame(double elapsed_s);
    void set_views(const Pose &pose, const Sample &sample);
    void for_each_pass(void (Pass::*call)(Frame &));
    void draw_linear(const Pose &pose, const Sample &sample);
    void finish();
    void make_main();
    /// Creates the targets of the drawn picture and resizes the passes.
    void make_targets();
    Picture make_picture() const;
    void make_filter_targets();
    void filter();
    bool has_filters() const;
    bool has_filters_now() const;
    void read_linear(std::vector<float> &pixels) const;

    const Scene &scene_;
    const gl::ShaderLibrary &shaders_;
    int width_px_ = 0, height_px_ = 0;      // of the shown picture; frame_ has those of the drawn one
    std::vector<std::size_t> pass_indices_; // indices into pass_names(), one per pass
    std::vector<std::unique_ptr<Pass>> passes_;
    struct CachedPass {
        std::size_t index;
        RenderSettings settings;
        std::unique_ptr<Pass> pass;
    };
    std::vector<CachedPass> cached_passes_; // built for settings that were used before
    bool has_post_ = false;
    MainTarget main_;
    Frame frame_;
    gl::Texture final_;
    gl::Framebuffer output_;
    Picture pictures_[2];
    std::size_t picture_ = 0; // the one that is shown
    gl::Texture resolved_depth_;
    gl::Framebuffer depth_framebuffer_;
    std::uint64_t first_draw_call_ = 0, draw_calls_ = 0;
};

} // namespace paradize
