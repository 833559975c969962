#pragma once
// One drawing step of the player, and the list of them.

#include "scene/quality.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize {

namespace gl {
class ShaderLibrary;
}
class Frame;
class Scene;
struct View;

/// What a pass may keep; it all outlives the passes.
struct PassSetup {
    const Scene &scene;
    const gl::ShaderLibrary &shaders;
    RenderSettings settings; // what the pass draws with; another detail is another pass
};

/// Constructors load shaders and make GL objects, and may throw; the functions below never throw and never
/// allocate (resize may). Each leaves GL in the default state: depth test LESS and depth writes on, back
/// faces culled, no blending, no alpha to coverage, all colours written, polygon offset off. Program, vertex
/// array, texture and sampler bindings may be left as they are.
class Pass {
  public:
    virtual ~Pass() = default;
    Pass() = default;
    Pass(const Pass &) = delete;
    Pass &operator=(const Pass &) = delete;

    /// The picture has this size: called before the first frame and after every change. Targets are made
    /// here.
    virtual void resize(int /*width_px*/, int /*height_px*/) {}
    /// One fixed step of the simulation, from `time_s` to time_s + step_s (passes/frame.hpp). Counted from
    /// second 0, so that a moment of the show looks the same however it was reached; a show that begins after
    /// its tenth minute begins to step ten minutes before.
    virtual void step(double /*time_s*/) {}
    /// Goes on from where the passes of another renderer have stepped to. False: it cannot, and is to be
    /// stepped from the beginning; true also for a pass that does not step.
    virtual bool continue_from(std::span<const std::unique_ptr<Pass>> /*before*/) { return true; }
    /// Before the picture: textures that others read (shadow map, reflection, refraction), put into
    /// frame.shared.
    virtual void prepare(Frame & /*frame*/) {}
    /// Draws what this pass has to show in one view. Called for every view; a pass ignores the kinds where it
    /// has nothing (view.kind).
    virtual void draw(const Frame & /*frame*/, const View & /*view*/) {}
    /// Whether filter() is to be called. Depth is resolved, and a second picture is there, where a pass says
    /// so.
    virtual bool filters() const { return false; }
    /// After the picture is resolved: from frame.shared.picture and frame.shared.depth into all of
    /// frame.filtered, in linear light. The next pass that filters, and finish(), find that as
    /// frame.shared.picture. FrameUniforms are the main view's.
    virtual void filter(Frame & /*frame*/) {}
    /// The step to the screen: from frame.shared.picture into frame.output.
    virtual void finish(Frame & /*frame*/) {}
};

/// Every name that --disable takes, in drawing order.
std::span<const std::string_view> pass_names();

/// The passes that the scene asks for, without the disabled ones: indices into pass_names(), rising.
std::vector<std::size_t> enabled_passes(const assets::SceneFile &file, std::span<const std::string> disabled);
/// Throws Error.
std::unique_ptr<Pass> make_pass(std::size_t index, const PassSetup &setup);
/// Is a pass made for one detail as good for the other?
bool reusable(std::size_t index, const RenderSettings &made_for, const RenderSettings &wanted);

} // namespace paradize
