#pragma once
// Draws all objects: opaque materials and those with holes in one pass, blended ones in a later pass.

#include "gl/draw.hpp"
#include "gl/handle.hpp"
#include "gl/material_uniforms.hpp"
#include "gl/program.hpp"
#include "gl/texture.hpp"
#include "passes/draw_list.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "streaming/scene.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace paradize {

class ObjectsPass : public Pass {
  public:
    explicit ObjectsPass(const PassSetup &setup) : ObjectsPass(setup, DrawnMaterials::solid) {}
    void draw(const Frame &frame, const View &view) override;

  protected:
    /// `drawn`: solid or blended.
    ObjectsPass(const PassSetup &setup, DrawnMaterials drawn);

  private:
    /// A variant of the programs for each kind of material that there is, so that none computes what it does
    /// not need: software rasterisers run both sides of every branch.
    struct Lit {
        Lit(const PassSetup &setup, const std::string &defines);

        gl::Program program;
        EnvironmentBindings environment;
        int solid; // location of u_solid; -1: the material is not blended
    };
    struct Depth {
        Depth(const PassSetup &setup, const std::string &defines);

        gl::Program program;
    };
    /// Of a material of an object: indices of its programs. `by_lights`: where point lights reach it.
    struct Programs {
        struct ViewPrograms {
            std::uint32_t lit = 0, by_lights = 0;
        };
        /// For views that show what is under water, and for those that do not.
        ViewPrograms whole, above_water;
        /// The same for the main view, where alpha becomes coverage of its samples.
        ViewPrograms covered_whole, covered_above_water;
        std::uint32_t depth = 0;
    };
    /// Commands that one call draws: their state is that of the first.
    struct Batch {
        const DrawCommand *command = nullptr;
        std::size_t first = 0, count = 0; // of draws_
    };
    const Programs &programs_of(const DrawCommand &command) const;
    /// The program that draws a command in a view that shows light; an index into lit_.
    std::uint32_t lit_program(const Frame &frame, const View &view, const DrawCommand &command) const;

    /// Lists what the view draws. False if it draws nothing.
    bool fill(DrawList &list, const Frame &frame, const View &view);
    /// Adds the draws of a command to the last batch.
    void add_draws(const DrawList &list, const DrawCommand &command);
    /// True if neither program nor material nor buffers differ in this view.
    bool is_alike(const Frame &frame, const View &view, const DrawCommand &a, const DrawCommand &b) const;
    void make_batches(const DrawList &list, const Frame &frame, const View &view);
    void draw_depth(const Frame &frame, const View &light);
    /// Binds the program and the material of a command, as far as they differ from the last command's.
    void use_lit(const Frame &frame, const View &view, const DrawCommand &command);
    void use_depth(const DrawCommand &command);
    /// Binds the uniforms of a material. Writes them if other maps are resident than before.
    void bind_uniforms(const Material &material);
    void bind_map(const Material &material, assets::ObjectMap map);
    void draw_batch(const Frame &frame, const Batch &batch, const View &view);
    void bind_instances(const GeometryPage &page, const gl::Buffer &instances, std::size_t first);
    /// Forgets what is bound, because other passes bind too.
    void forget_state();
    unsigned sampler(gl::Wraps wraps, bool nearest, std::optional<int> max_level,
                     const RenderSettings &settings);

    struct CachedSampler {
        gl::Wraps wraps;
        bool nearest;
        std::optional<int> max_level;
        gl::Sampler sampler;
    };
    struct BoundMap {
        const StreamedTexture *texture = nullptr;
        unsigned sampler = 0;
        bool operator==(const BoundMap &) const = default;
    };
    struct BoundInstances {
        const GeometryPage *page = nullptr;
        std::size_t first = 0;
        bool operator==(const BoundInstances &) const = default;
    };

    DrawnMaterials drawn_;
    DrawList list_;
    std::optional<DrawList> casters_;     // of the light's view; empty: this pass does not draw it
    std::vector<gl::IndirectDraw> draws_; // of the list that is drawn
    std::vector<Batch> batches_;
    bool has_indirect_ = false;
    std::deque<Lit> lit_;
    std::deque<Depth> depth_;
    std::vector<std::vector<Programs>> programs_; // by object and material
    std::vector<CachedSampler> samplers_;
    std::vector<assets::PerMap<unsigned>> samplers_of_; // by Material::id
    gl::Buffer indirect_;                               // where the device has indirect calls
    gl::Buffer instances_;                              // of the list that is drawn, where it has none
    gl::Buffer uniforms_;                               // gl::MaterialUniforms by Material::id
    std::size_t uniform_bytes_ = 0;                     // of each, aligned
    std::vector<gl::MaterialUniforms> written_;
    // what is bound
    std::optional<std::uint32_t> program_;
    std::optional<std::uint32_t> material_;
    std::optional<std::uint32_t> light_block_;
    std::optional<bool> two_sided_, mirrored_;
    assets::PerMap<BoundMap> maps_;
    BoundInstances bound_;
};

/// Draws blended materials, after everything that is solid.
class BlendedPass : public ObjectsPass {
  public:
    explicit BlendedPass(const PassSetup &setup) : ObjectsPass(setup, DrawnMaterials::blended) {}
};

} // namespace paradize
