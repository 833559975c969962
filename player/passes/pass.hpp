#pragma once
// The interface of a drawing pass, and the list of all passes.

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

/// Input of a pass's constructor. The references outlive the pass.
struct PassSetup {
    const Scene &scene;
    const gl::ShaderLibrary &shaders;
    RenderSettings settings; // fixed for the pass's lifetime; other settings may need another pass
};

/// A drawing pass. The constructor loads shaders and creates GL objects; it may throw. The functions below
/// never throw, and only resize() may allocate. Each function leaves GL in the default state: depth test
/// LESS, depth writes on, back faces culled, no blending, no alpha to coverage, all colour channels written,
/// polygon offset off. Bindings of programs, vertex arrays, textures and samplers may change.
class Pass {
  public:
    virtual ~Pass() = default;
    Pass() = default;
    Pass(const Pass &) = delete;
    Pass &operator=(const Pass &) = delete;

    /// Called before the first frame and whenever the drawn or the shown picture's size changes, which the
    /// frame has. Create render targets here.
    virtual void resize(const Frame & /*frame*/) {}
    /// Writes what draw() needs of this frame. All passes do so before any is prepared, because prepare()
    /// draws passes in other views. What moves is a function of frame.clock alone, so that a frame needs none
    /// of those before it.
    virtual void update(Frame & /*frame*/) {}
    /// Draws textures that other passes sample (shadow map, reflection, refraction) and stores them in
    /// frame.shared. Called before the main view.
    virtual void prepare(Frame & /*frame*/) {}
    /// Draws this pass in one view. Called for every view; check view.kind.
    virtual void draw(const Frame & /*frame*/, const View & /*view*/) {}
    /// True if filter() may be called. The renderer then keeps a second picture and a resolved depth.
    virtual bool filters() const { return false; }
    /// False if filter() would leave this frame's picture as it is. It is not called then.
    virtual bool filters_now(const Frame & /*frame*/) const { return filters(); }
    /// Draws from frame.shared.picture and frame.shared.depth (resolved) into all of frame.filtered, in
    /// linear light. The result becomes frame.shared.picture for the next filter and for finish(). The main
    /// view's FrameUniforms are bound.
    virtual void filter(Frame & /*frame*/) {}
    /// Draws from frame.shared.picture to the screen format, into all of frame.output.
    virtual void finish(Frame & /*frame*/) {}
};

/// All names that --disable accepts, in drawing order.
std::span<const std::string_view> pass_names();

/// Returns the passes that the scene needs and that are not disabled, as ascending indices into pass_names().
std::vector<std::size_t> enabled_passes(const assets::SceneFile &file, std::span<const std::string> disabled);
/// Builds the pass with this index. Throws Error.
std::unique_ptr<Pass> make_pass(std::size_t index, const PassSetup &setup);
/// True if a pass that was built with one set of settings gives the same picture as one built with the other.
bool reusable(std::size_t index, const RenderSettings &made_for, const RenderSettings &wanted);

} // namespace paradize
