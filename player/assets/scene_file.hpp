#pragma once
// scene.json, version 3, as plain values. Knows no GL. What a name means is in
// pipeline/paradize/formats/FORMAT.md.

#include "assets/object_maps.hpp"

#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {

enum class ArtifactKind { mesh, texture, cubemap, sound };

struct Artifact {
    std::string name;
    std::string file; // inside the scene's folder
    ArtifactKind kind = ArtifactKind::mesh;
    std::string sha256; // of the file, 64 hex digits
    std::uint64_t bytes = 0;
    double first_needed_s = 0.0;
    std::optional<int> max_level; // the coarsest mip to sample; beyond it neighbours bleed in
    int trimmed_levels = 0;       // levels finer than the file's that no view of the flight asks for
};

/// Where a steered camera may be: what is baked is as fine as it needs there.
struct FreeCameraBox {
    glm::dvec3 low{0.0}, high{0.0}; // corners of a box
    float near_m = 0.0F;            // how near it comes to a surface
};

struct Sun {
    glm::vec3 direction{0.0F, 1.0F, 0.0F}; // unit, from the ground to the sun
    glm::vec3 color{1.0F};                 // linear
    float intensity = 1.0F;
    float angular_diameter_rad = 0.0093F;
};

struct Ambient {
    glm::vec3 color{1.0F};
    float intensity = 0.0F;
};

struct Fog {
    glm::vec3 color{1.0F};
    float density_per_m = 0.0F;
};

struct Shadow {
    int size_px = 2048;
    float extent_m = 100.0F; // edge of the square that the map covers
    glm::dvec3 center{0.0};
    float blur_distance_m = 50.0F; // beyond this from the eye the shadow's edge is not blurred
};

/// Right triangles of several sizes that cover the terrain; the coarse levels first. Columns of one length, a
/// row a patch; spheres are in the world.
struct TerrainPatches {
    std::vector<std::uint32_t> tile;          // index into Terrain::tiles, never falling
    std::vector<std::uint32_t> node;          // of the tile's GLB, rising within a tile
    std::vector<std::uint32_t> level;         // never falling
    std::vector<std::int32_t> parent_diamond; // the diamond whose split shows it; -1: a root
    std::vector<std::int32_t> diamond;    // the diamond whose split replaces it; -1: nothing finer is baked
    std::vector<glm::vec3> center;        // of a sphere around it, metres
    std::vector<float> radius_m, error_m; // error: measured, vertical

    std::size_t size() const { return tile.size(); }
};

/// The one or two patches that share a hypotenuse; they split together. Columns of one length, coarse first.
struct TerrainDiamonds {
    std::vector<std::uint32_t> level;
    std::vector<float> error_m; // of its patches and of all that come of them
    std::vector<glm::vec3> center;
    std::vector<float> radius_m;

    std::size_t size() const { return level.size(); }
};

struct Terrain {
    std::vector<std::string> tiles; // artifacts of kind mesh
    TerrainPatches patches;
    TerrainDiamonds diamonds;
    std::uint64_t trimmed_patches =
        0; // patches that no moment of the flight asks for and that were not baked
    std::string sand_color, effect_color, effect_normal, sand_normal; // artifacts; empty: none
    float sand_repeat = 1.0F;                                         // TEXCOORD_0 spans [0, sand_repeat]
    float mix_low_m = 0.0F;                                           // at and below: effect only
    float mix_high_m = 2.0F;                                          // at and above: sand only
    float specular = 0.0F;
    float smoothness = 0.0F;
    float wet_high_m = 0.0F;     // sand is wet up to here above the water
    float wet_darkness = 0.0F;   // of wet sand, 0 to 1
    float wet_smoothness = 0.0F; // of wet sand
    glm::vec2 size_m{1.0F};
    glm::vec2 height_range_m{0.0F};
};

struct Water {
    std::string normal, dudv;
    float level_m = 0.0F;
    float size_m = 1.0F;
    float tile = 1.0F;            // how often the wave maps lie along size_m
    float k = 0.0F;               // refraction strength
    glm::vec2 scroll_per_s{0.0F}; // tiles per second
    float strength = 1.0F;        // how far the du/dv map shakes the reflection
    glm::vec3 deep_color{0.0F};
    glm::vec3 shallow_color{0.0F};
    glm::vec3 absorption_per_m{0.0F};
    float specular = 1.0F;
    float smoothness = 0.9F;
};

struct Material {
    std::string name;
    glm::vec3 color{1.0F}; // linear; the colour map times this
    float parallax_scale = 0.0F;
    float parallax_bias = 0.0F;
    std::optional<float> parallax_limit; // how far a sample may be moved, of the map's sides
    float specular = 0.0F;
    float smoothness = 0.3F;
    bool two_sided = false;
    float alpha_cutoff = 0.0F; // 0: opaque
};

struct ObjectLod {
    std::string node;
    float error_m = 0.0F;
};

struct Placement {
    glm::dvec3 position{0.0};
    double yaw_rad = 0.0;
    double scale = 1.0;
};

struct Object {
    std::string name, mesh;   // mesh: an artifact
    PerMap<std::string> maps; // artifacts; empty: none
    glm::dvec3 center{0.0};   // bounding sphere in the mesh's space
    float radius_m = 1.0F;
    bool camera = true, shadow = true, reflection = true, refraction = true; // the views that draw it
    bool repeat = true;          // its maps tile, else they end at their edges
    std::vector<ObjectLod> lods; // level 0, the finest, first
    std::vector<Material> materials;
    std::vector<Placement> instances;
};

struct ParticleField {
    std::string name;
    glm::dvec3 center{0.0};
    float radius_m = 1.0F;
    int count = 0;
    glm::vec2 size_m{0.05F, 0.1F};    // smallest, largest
    glm::vec2 life_per_s{0.2F, 0.5F}; // slowest, fastest loss of life
    float threshold = 0.1F;           // reborn below this life
    glm::vec3 color{1.0F};            // linear

    bool operator==(const ParticleField &) const = default;
};

struct Sound {
    std::string artifact;
    float volume = 1.0F;
};

/// value(u) = a + b u + c u^2 + d u^3 with (a, b, c, d) in a vec4, u in [0, 1].
struct FlightSegment {
    std::array<glm::dvec4, 3> eye{};    // x, y, z; metres
    std::array<glm::dvec4, 3> target{}; // x, y, z; metres
    glm::dvec4 roll{0.0};               // rad
};

struct TimeKnot {
    double time_s = 0.0;
    double position = 0.0; // U: whole part is the segment
    double speed = 0.0;    // dU/dt, 1/s
};

struct Flight {
    double duration_s = 1.0;
    float fov_rad = 1.0F; // vertical
    float near_m = 0.5F;
    float far_m = 1000.0F;
    std::vector<FlightSegment> segments;
    std::vector<TimeKnot> time_table;
};

struct SceneFile {
    std::string name;
    float exposure = 1.0F;
    int width_px = 1280;
    int height_px = 720;
    int largest_width_px = 1280; // of a picture that the scene was baked for
    int largest_height_px = 720;
    std::optional<FreeCameraBox> free_camera;
    float lod_error_px = 1.0F;
    double poster_s = 0.0;
    std::vector<Artifact> artifacts;      // sorted by name
    std::vector<std::uint32_t> streaming; // indices of artifacts, in the order of their upload
    Sun sun;
    Ambient ambient;
    Fog fog;
    std::string sky; // cube map artifact; empty: none
    std::optional<Shadow> shadow;
    std::optional<float> reflection_scale; // of the picture's size
    std::optional<float> refraction_scale;
    std::optional<Terrain> terrain;
    std::optional<Water> water;
    std::vector<Object> objects;
    std::vector<ParticleField> particles;
    std::optional<Sound> sound;
    Flight flight;

    /// Is there anything finer than what the files hold, because no view of the flight asks for it?
    bool is_trimmed() const;

    /// nullptr when there is none of that name.
    const Artifact *find_artifact(std::string_view artifact) const;
};

/// Reads and checks scene.json's text. Throws Error with file, place in the document, value and limit;
/// refuses another format, another version, unknown keys, dangling references, numbers out of range or not
/// finite.
SceneFile parse_scene(std::string_view text, const std::filesystem::path &file);
/// The same of a file. Throws Error when it cannot be read, too.
SceneFile read_scene(const std::filesystem::path &file);

} // namespace paradize::assets
