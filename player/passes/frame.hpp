#pragma once
// What a pass is handed in a frame: the clock, the views, what is visible in each, and what other passes
// made.

#include "gl/handle.hpp"
#include "passes/pass_meter.hpp"
#include "scene/quality.hpp"
#include "scene/view.hpp"
#include "streaming/scene.hpp"
#include "streaming/terrain_tiles.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace paradize {

class Pass;

/// Length of one step of the simulation (Pass::step).
inline constexpr double step_s = 1.0 / 120.0;

struct Clock {
    double elapsed_s = 0.0; // since the start; grows for ever: reduce it in double before it becomes a float
    double flight_s = 0.0;  // second of the flight, in [0, duration)
    double delta_s = 0.0;   // since the last frame; 0 in the first
    std::uint64_t frame = 0;
};

/// What one pass makes for others to sample in the same frame. nullptr: that pass is disabled or absent.
struct Shared {
    const gl::Texture *shadow_map = nullptr;       // the light's depth, as the shadow pass documents it
    const gl::Texture *reflection = nullptr;       // linear HDR, seen by View mirror
    const gl::Texture *refraction = nullptr;       // linear HDR, seen by View refraction
    const gl::Texture *refraction_depth = nullptr; // its depth, window [0, 1]
    const gl::Texture *picture =
        nullptr;                        // the resolved linear HDR picture, RGBA16F; for filter() and finish()
    const gl::Texture *depth = nullptr; // its depth, window [0, 1], one sample of each pixel; for filter()
};

class Frame {
  public:
    Frame(const Scene &scene, std::span<const std::unique_ptr<Pass>> passes);
    Frame(const Frame &) = delete;
    Frame &operator=(const Frame &) = delete;
    ~Frame();

    const Scene &scene;
    Clock clock;
    Shared shared;
    RenderSettings settings;            // what this frame is drawn with
    glm::vec3 to_sun{0.0F, 1.0F, 0.0F}; // unit; in a sample of the reference a place of the sun's disc
    PassMeter *meter = nullptr;         // measures the main view's passes; nullptr: nobody asks
    int width_px = 0, height_px = 0;    // of the picture
    unsigned filtered = 0;              // framebuffer that filter() draws into: RGBA16F, width x height
    unsigned output = 0;                // framebuffer that finish() draws into: RGBA8, width x height

    /// The views of this frame; copy one to change it (its size, its clip plane) before draw_view.
    const View &view(ViewKind kind) const { return views_[static_cast<std::size_t>(kind)]; }
    /// Height of the water in the views' coordinates; far below where there is none.
    float water_m() const;
    /// Visible instances, culled and with their level, in this view.
    std::span<const DrawItem> visible(ViewKind kind) const {
        return visible_[static_cast<std::size_t>(kind)];
    }

    /// The terrain with the cut of this frame; nullptr: the scene has none.
    TerrainTiles *terrain() const { return terrain_.get(); }

    /// Uploads and binds FrameUniforms for the view, binds the framebuffer with the view's size as viewport,
    /// sets winding and clip distance, clears depth and (unless depth_only) colour to transparent black, lets
    /// every pass draw in order, and puts the default state back. Restores no framebuffer.
    void draw_view(const View &view, unsigned framebuffer, bool depth_only = false);

    /// Draws three vertices without attributes: a full-screen triangle made from gl_VertexID.
    void draw_fullscreen() const;

  private:
    friend class Renderer;
    std::array<View, view_kinds> views_;
    std::array<std::vector<DrawItem>, view_kinds> visible_;
    std::unique_ptr<TerrainTiles> terrain_;
    std::span<const std::unique_ptr<Pass>> passes_;
    gl::Buffer uniforms_;
    gl::VertexArray empty_vertex_array_;
    std::size_t slot_bytes_ = 0;
    int slot_ = 0;
};

} // namespace paradize
