#pragma once
// The inputs of a pass in each frame: clock, views, visible instances, and the textures of other passes.

#include "gl/handle.hpp"
#include "passes/draw_list.hpp"
#include "passes/pass_meter.hpp"
#include "passes/point_lights.hpp"
#include "scene/cascades.hpp"
#include "scene/daylight.hpp"
#include "scene/quality.hpp"
#include "scene/view.hpp"
#include "streaming/scene.hpp"
#include "streaming/terrain_tiles.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace paradize {

class Pass;

struct Clock {
    double elapsed_s = 0.0; // since the start; unbounded, so wrap it in double before converting it to float
    double flight_s = 0.0;  // second of the flight, in [0, duration)
    std::uint64_t frame = 0;
};

/// Textures that one pass makes for others in the same frame. nullptr: that pass is disabled or absent.
struct Shared {
    const gl::Texture *shadow_map = nullptr;               // depth seen by the light, a layer per cascade
    std::array<glm::vec4, max_cascades> shadow_cascades{}; // cascade_fit() of each
    const gl::Texture *environment = nullptr;              // cube map of the sky with mips, linear HDR
    const gl::Texture *reflection = nullptr;               // linear HDR, seen by ViewKind::mirror
    const gl::Texture *refraction = nullptr;               // linear HDR, seen by ViewKind::refraction
    const gl::Texture *refraction_depth = nullptr;         // window depth [0, 1] of the refraction view
    const gl::Texture *picture = nullptr; // resolved linear HDR, RGBA16F; for filter() and finish()
    const gl::Texture *depth = nullptr;   // its window depth [0, 1], one sample; for filter()
};

class Frame {
  public:
    Frame(Scene &scene, std::span<const std::unique_ptr<Pass>> passes);
    Frame(const Frame &) = delete;
    Frame &operator=(const Frame &) = delete;
    ~Frame();

    const Scene &scene;
    Clock clock;
    Shared shared;
    PointLights point_lights;
    RenderSettings settings;    // settings of this frame
    Daylight daylight;          // of this second; in --reference from a point of the light's disc
    PassMeter *meter = nullptr; // measures the passes of the main view; nullptr: no measurement
    // processor time of this thread for what the frame draws: culling, levels, terrain cut, draw lists
    mutable double scene_ms = 0.0;
    int width_px = 0, height_px = 0; // of the drawn picture
    unsigned filtered = 0;           // framebuffer that filter() draws into: RGBA16F, width_px x height_px
    int output_width_px = 0, output_height_px = 0; // of the shown picture
    unsigned output = 0;                           // framebuffer of that size that finish() draws into: RGBA8

    /// The views of this frame. Copy a view to change its size or clip plane before draw_view().
    const View &view(ViewKind kind) const { return views_[static_cast<std::size_t>(kind)]; }
    /// Returns the water level in the views' coordinates. Far below if there is no water.
    float water_m() const;
    /// True if nothing under the water is seen in this view but through the refraction texture.
    bool hides_under_water(const View &view) const;
    /// True if the opaque surfaces of this view are drawn within a gl::LateDepthTest.
    bool tests_depth_late(const View &view) const { return settings.late_depth_test && view.samples > 1; }
    /// Returns the visible instances of this view, with their level of detail.
    std::span<const DrawItem> visible(ViewKind kind) const {
        return visible_[static_cast<std::size_t>(kind)];
    }

    /// The transforms of all instances in this frame's views.
    const InstanceTransforms &transforms() const { return transforms_; }
    /// The same on the device, where it has indirect calls (gl/draw.hpp).
    const gl::Buffer &instances() const { return instances_; }

    /// Places what moves where it is at a second since the start.
    void move_to(double elapsed_s);

    /// Lists what `light` sees as visible(ViewKind::light), with the main view's levels of detail.
    void cull_casters(const View &light);

    /// Returns the terrain with this frame's cut, or nullptr if the scene has none.
    TerrainTiles *terrain() const { return terrain_.get(); }

    /// Draws all passes in one view, in order. Uploads FrameUniforms, binds the framebuffer with the view's
    /// size, sets winding and clip distance, and clears depth and (unless depth_only) colour to transparent
    /// black. Afterwards the GL state is the default state; the framebuffer stays bound. wind_s: the second
    /// whose wind it shows; empty: now.
    void draw_view(const View &view, unsigned framebuffer, bool depth_only = false,
                   std::optional<double> wind_s = {});

    /// Draws a full-screen triangle from gl_VertexID, without attributes.
    void draw_fullscreen() const;

  private:
    friend class Renderer;
    Scene &moving_; // the scene
    std::array<View, view_kinds> views_;
    std::array<std::vector<DrawItem>, view_kinds> visible_;
    InstanceTransforms transforms_;
    gl::Buffer instances_;
    std::unique_ptr<TerrainTiles> terrain_;
    std::span<const std::unique_ptr<Pass>> passes_;
    gl::Buffer uniforms_;
    gl::VertexArray empty_vertex_array_;
    std::size_t slot_bytes_ = 0;
    int slot_ = 0;
};

} // namespace paradize
