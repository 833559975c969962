#pragma once
// The instances of an object: a tree of boxes that finds the visible ones and their levels of detail, and
// their transforms. Uses no GL.

#include "scene/view.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

struct Instance {
    glm::dmat4 model{1.0};  // world from mesh
    glm::dvec3 center{0.0}; // bounding sphere in the world
    float radius_m = 0.0F;
    float scale = 1.0F;       // largest of its axes
    bool mirrored = false;    // triangle winding is reversed
    std::uint32_t light = 0;  // index into Object::light_sets
    std::uint32_t number = 0; // in the order of scene.json
    // xyz of Moved::beat, where nothing beats the material's wind_reach; w its set of SceneFile::light_sets
    glm::vec4 beat{0.0F};
};

/// Rows of the matrix from the mesh to the view's coordinates, as shaders/lib/model.glsl reads them; then
/// Instance::beat, which shaders/lib/beat.glsl, shaders/depth.vert and shaders/object.vert read.
using InstanceRows = std::array<glm::vec4, 4>;
static_assert(sizeof(InstanceRows) == 64);

/// Returns the transforms relative to `anchor` in `rows`, one per instance.
void find_rows(std::span<const Instance> instances, const glm::dvec3 &anchor, std::span<InstanceRows> rows);

/// Neighbours in the list of instances, all of one winding, that are drawn at one level of detail.
struct InstanceRange {
    std::uint32_t first = 0, count = 0;
    int lod = 0;
    bool mirrored = false;
    bool operator==(const InstanceRange &) const = default;
};

/// From where levels of detail are chosen, and how fine they must be. Instances no wider than `least_px` are
/// left out.
struct LodQuery {
    glm::vec3 eye{0.0F};             // in the view's coordinates
    float pixels_at_1m = 1.0F;       // pixels per metre at a distance of one metre
    float error_px = 1.0F;           // accepted error
    std::span<const float> errors_m; // of an instance of scale 1; level 0 comes first
    float least_px = 0.0F;
};

/// The instance that fills most pixels: its pixels per metre of the mesh, at most those at a distance of
/// near_m, and its level. Both only grow.
struct NearestInstance {
    float pixels_per_m = 0.0F;
    int lod = 0;
};

/// A tree of boxes over instances: J. H. Clark, "Hierarchical Geometric Models for Visible Surface
/// Algorithms", 1976. Built once. A query allocates nothing, and looks at single instances only in boxes that
/// the view's border or the border between two levels crosses.
class InstanceTree {
  public:
    InstanceTree() = default;
    /// Sorts the instances: those of a box are neighbours, and so are the mirrored ones.
    explicit InstanceTree(std::vector<Instance> &instances);

    /// Finds the boxes anew after instances have moved; which of them share a box stays.
    void refit(std::span<const Instance> instances);

    /// Calls take(InstanceRange) for what `view` sees, in the order of the list. Ranges may touch.
    template <class Take>
    void collect(const View &view, const LodQuery &query, const Take &take) const {
        // Below a node that is inside, or at one level, all nodes are; the first that is not below it:
        std::size_t inside_until = 0;
        std::size_t level_until = 0;
        Levels levels;
        for (std::size_t at = 0; at < nodes_.size();) {
            const Node &node = nodes_[at];
            const Side side = at < inside_until ? Side::inside : side_of(node, view);
            if (side == Side::outside) {
                at = node.next;
                continue;
            }
            if (side == Side::inside && at >= inside_until) {
                inside_until = node.next;
            }
            if (at >= level_until) {
                levels = levels_of(node, view, query);
                level_until = levels.one ? node.next : 0;
            }
            if (levels.one && levels.lod < 0) {
                at = node.next;
                continue;
            }
            if (levels.one && side == Side::inside) {
                take(InstanceRange{node.first, node.count, levels.lod, node.first >= first_mirrored_});
                at = node.next;
                continue;
            }
            at = node.is_leaf() ? node.next : at + 1;
            for (std::uint32_t i = node.first; node.is_leaf() && i < node.first + node.count; ++i) {
                const glm::vec3 center = view.local(spheres_[i].center);
                if (side != Side::inside && !view.sees(center, spheres_[i].radius_m)) {
                    continue;
                }
                const int lod = levels.one ? levels.lod : lod_of(spheres_[i], center, query);
                if (lod >= 0) {
                    take(InstanceRange{i, 1, lod, i >= first_mirrored_});
                }
            }
        }
    }
    /// Raises `nearest` to the visible instance that fills most pixels, and lowers its level to the finest.
    void find_nearest(const View &view, const LodQuery &query, float near_m, NearestInstance &nearest) const;

    /// Returns the largest scale of the visible instances, 0 if none is visible.
    float largest_scale(const View &view) const;

    std::size_t size() const { return nodes_.size(); }

  private:
    /// The part of an Instance that queries read: small, because they read many.
    struct Sphere {
        glm::dvec3 center{0.0}; // world
        float radius_m = 0.0F, scale = 1.0F;
    };
    struct Node {
        glm::dvec3 center{0.0}; // of the box around the instances' centres, world
        glm::vec3 half{0.0F};   // half its edges, metres
        float least_radius_m = 0.0F, most_radius_m = 0.0F;
        float least_scale = 0.0F, most_scale = 0.0F;
        std::uint32_t first = 0, count = 0; // instances
        std::uint32_t next = 0;             // the node after all its children, which follow it
        bool leaf = false;
        bool is_leaf() const { return leaf; }
    };
    enum class Side { outside, inside, crossed };
    struct Levels {
        bool one = false; // all instances of the node are drawn at the same one
        int lod = 0;      // which; negative: they are left out
    };
    struct Reach {
        float least_m = 0.0F, most_m = 0.0F;
    };

    static Node around(std::span<const Sphere> spheres);
    static Node around(const Node &a, const Node &b);
    void build(std::vector<std::uint32_t> &order, const std::vector<Instance> &instances, std::uint32_t first,
               std::uint32_t count);
    static Levels levels_of(const Node &node, const View &view, const LodQuery &query);
    /// Inside: the view sees every instance of the node.
    static Side side_of(const Node &node, const View &view);
    /// Bounds of the distances from a point to the spheres.
    static Reach distances(const Node &node, const View &view, const glm::vec3 &eye);
    /// `center`: of the sphere, in the view's coordinates. Negative: left out.
    static int lod_of(const Sphere &sphere, const glm::vec3 &center, const LodQuery &query);

    std::vector<Node> nodes_;          // parents before children
    std::vector<Sphere> spheres_;      // of the sorted instances
    std::uint32_t first_mirrored_ = 0; // of these
};

/// Returns the coarsest level whose error covers at most `error_px` pixels at `distance_m`, or 0 if none
/// does. `errors_m` starts with level 0 and grows.
int choose_lod(std::span<const float> errors_m, float distance_m, float pixels_at_1m, float error_px);

} // namespace paradize
