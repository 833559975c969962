#pragma once
// scene.json, version 10, as plain values. Uses no GL. pipeline/paradize/formats/FORMAT.md describes the
// members.

#include "assets/scene/object_maps.hpp"

#include <glm/gtc/quaternion.hpp>
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
    std::string file; // relative to the scene's folder
    ArtifactKind kind = ArtifactKind::mesh;
    std::string sha256; // of the file, 64 hex digits
    std::uint64_t bytes = 0;
    double first_needed_s = 0.0;
    bool drawn = true;            // false: nothing in the scene refers to this mesh or texture
    std::optional<int> max_level; // coarsest mip to sample; coarser mips mix neighbouring charts
    // finer mips or LODs that the bake left out, because no view of the flight needs them
    int trimmed_levels = 0;
};

/// The region of the free camera. The bake is fine enough everywhere inside it.
struct FreeCameraBox {
    glm::dvec3 low{0.0}, high{0.0}; // corners of the box
    float near_m = 0.0F;            // smallest distance to a surface
};

struct Sun {
    glm::vec3 direction{0.0F, 1.0F, 0.0F}; // unit, from ground to sun
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

/// A lamp. It shines alike in all directions and throws no shadow.
struct PointLight {
    std::string name;
    glm::dvec3 position{0.0};
    glm::vec3 color{1.0F};          // linear
    float intensity = 1.0F;         // on a surface one metre away that faces it, in the unit of the sun's
    float radius_m = 0.05F;         // of what glows
    float range_m = 10.0F;          // it lights nothing farther away
    bool always = true;             // on at every second of the flight
    double on_s = 0.0, off_s = 0.0; // else: seconds of the flight; off may come before on
    float fade_s = 0.0F;            // from dark to full after on_s, and back after off_s
    float flicker = 0.0F;           // share of its light that comes and goes
    float beam_m = 0.0F;            // height of its beam into the sky; 0: none
};

/// A draw call takes so many lights.
inline constexpr std::size_t max_lights_of_a_set = 16;

/// Lights of SceneFile::lights that reach what is drawn together, in rising order.
struct LightSet {
    std::vector<std::uint32_t> lights;
    std::optional<std::uint32_t> glow; // the light whose strength multiplies what the surface gives off
};

/// Where a light stands in the sky, and how bright it is.
struct SkyLight {
    float azimuth_rad = 0.0F;   // from north (-Z) over east (+X)
    float elevation_rad = 0.0F; // above the horizon
    glm::vec3 color{1.0F};      // linear
    float intensity = 0.0F;
};

/// The light of the scene at one second of the flight. Between keys the light changes smoothly.
struct DaytimeKey {
    double at_s = 0.0;
    SkyLight sun, moon;
    Ambient ambient;
    Fog fog;
    float exposure = 1.0F;
    std::string sky;              // cube map artifact, without discs, stars and clouds
    float sky_azimuth_rad = 0.0F; // of the light in it
};

/// Clouds around the horizon, a picture that is as wide as a part of the circle.
struct Clouds {
    std::string map;       // artifact; R, G, B: light from the right, the left, above; A: cover
    float high_rad = 0.5F; // elevation of its upper edge; the lower one is the horizon
    int repeat = 1;        // times around the horizon
    int drift_repeats = 0; // how many of them the clouds drift by in a flight
};

struct Shadow {
    int size_px = 2048;
    float extent_m = 100.0F; // edge of the square that the map covers
    glm::dvec3 center{0.0};
    float blur_distance_m = 50.0F; // beyond this distance from the eye the shadow's edge is not blurred
};

/// The share of sunlight and moonlight that the air scatters, beyond the haze: it shows shadows in the air.
struct LightShafts {
    float density_per_m = 0.03F; // share of the light scattered per metre
    float anisotropy = 0.5F;     // above 0: brighter towards the light
    float range_m = 40.0F;       // of this air, from the eye
};

/// Right triangles of several sizes that cover the terrain, coarse levels first. A table with one row per
/// patch; all columns have the same length. Spheres are in world space.
struct TerrainPatches {
    std::vector<std::uint32_t> tile;          // index into Terrain::tiles, ascending
    std::vector<std::uint32_t> node;          // node index in the tile's GLB, ascending within a tile
    std::vector<std::uint32_t> level;         // ascending
    std::vector<std::int32_t> parent_diamond; // diamond whose split creates this patch; -1: a root
    std::vector<std::int32_t> diamond; // diamond whose split replaces this patch; -1: there is nothing finer
    std::vector<glm::vec3> center;     // bounding sphere, metres
    std::vector<float> radius_m, error_m; // error: measured vertically

    std::size_t size() const { return tile.size(); }
};

/// A diamond is the one or two patches that share a hypotenuse; they split together. A table with one row per
/// diamond, coarse levels first.
struct TerrainDiamonds {
    std::vector<std::uint32_t> level;
    std::vector<float> error_m; // largest error of its patches and of all their descendants
    std::vector<glm::vec3> center;
    std::vector<float> radius_m;

    std::size_t size() const { return level.size(); }
};

/// The highest ground of each cell of a grid over the terrain, row by row from -X, -Z.
struct TerrainFloor {
    int columns = 0, rows = 0; // 0: the bake wrote none
    glm::vec2 cell_m{1.0F};
    std::vector<float> highest_m;
};

struct Terrain {
    std::vector<std::string> tiles; // artifacts of kind mesh
    TerrainPatches patches;
    TerrainDiamonds diamonds;
    std::vector<std::uint32_t> light_sets; // of each patch; empty: no light reaches any
    std::uint64_t trimmed_patches = 0;     // left out by the bake, because no view of the flight needs them
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
    TerrainFloor floor;
};

/// Where an object crosses the water's surface.
struct RippleCircle {
    double x_m = 0.0, z_m = 0.0;
    float radius_m = 0.0F;
};

struct Water {
    std::string normal, dudv;
    float level_m = 0.0F;
    float size_m = 1.0F;
    float wave_repeat = 1.0F;           // of the wave maps along size_m
    glm::vec2 scroll_per_s{0.0F};       // repeats per second
    float reflection_distortion = 1.0F; // how far waves move what they show, as a share of the picture
    float refraction_distortion = 0.0F;
    glm::vec3 deep_color{0.0F};
    glm::vec3 shallow_color{0.0F};
    glm::vec3 absorption_per_m{0.0F};
    float specular = 1.0F;
    float smoothness = 0.9F;
    float swash_height_m = 0.0F;  // up to which waves run up the beach; 0: none
    int swash_waves = 1;          // in a flight
    float wave_height_m = 0.0F;   // of waves near the camera, trough to crest; 0: the surface is flat
    float wave_length_m = 9.0F;   // of the longest of them
    float ripple_height_m = 0.0F; // of ripples round the circles, trough to crest
    std::vector<RippleCircle> ripples;
    std::uint32_t light_set = 0;
};

/// The effect of alpha: none; texels below the cutoff are holes; the surface mixes with what is behind it.
enum class AlphaMode { opaque, mask, blend };

/// How a material's maps continue beyond their edges.
enum class Wrap { repeat, clamp, mirror };

/// Factors multiply what their maps hold. Without the map they stand alone.
struct Material {
    std::string name;
    PerMap<std::string> maps;                                    // artifacts; empty: none
    std::array<Wrap, 2> wrap{Wrap::clamp, Wrap::clamp};          // of u and v
    std::array<Wrap, 2> second_wrap{Wrap::repeat, Wrap::repeat}; // of maps on second texture coordinates
    bool nearest = false;                                        // enlarged texels are squares
    glm::vec3 color{1.0F};                                       // linear
    float opacity = 1.0F;
    float metalness = 0.0F;
    glm::vec3 emission{0.0F}; // linear
    float occlusion_strength = 1.0F;
    float parallax_scale = 0.0F;
    float parallax_bias = 0.0F;
    std::optional<float> parallax_limit; // largest displacement of a sample, relative to the map's edge
    float specular = 0.0F;
    float smoothness = 0.3F;
    bool two_sided = false;
    float translucency = 0.0F; // share of the light from behind that passes through
    AlphaMode alpha_mode = AlphaMode::opaque;
    float alpha_cutoff = 0.5F;  // of AlphaMode::mask
    bool vertex_colors = false; // the mesh's colours multiply colour and opacity
    bool unlit = false;         // they multiply what it gives off, too
    bool vertex_lit = false;    // light may be found at the vertices alone
    glm::vec2 wind_reach{0.0F}; // metres that wind moves the object in a full gust: lean, flutter
    bool beats = false;         // its wings or legs move
    glm::vec3 beat{0.0F};       // Beat::hinge_m, lag_rad_per_m, stagger_rad_per_m

    bool sways() const { return wind_reach != glm::vec2(0.0F); }

    bool operator==(const Material &) const = default;
};

struct Wind {
    glm::vec2 direction{1.0F, 0.0F}; // where it blows to, along X and Z; unit
    float speed_m_per_s = 0.0F;      // of its gusts
    float gust_m = 1.0F;             // from one to the next
};

/// How wings or legs move: what is farther than the hinge from the plane x = 0 of the mesh turns up and down,
/// and forwards and back.
struct Beat {
    int per_lap = 0; // beats in a round
    float hinge_m = 0.0F;
    double lift_rad = 0.0, swing_rad = 0.0; // to each side
    float lag_rad_per_m = 0.0F;             // what is farther from the hinge is later
    float stagger_rad_per_m = 0.0F;         // what lies farther along Z is earlier
    int glides = 0;                         // times in a round that they rest
    double glide_share = 0.0;               // of the time
};

/// How each instance moves round an ellipse in its own plane, once round in a whole share of the flight
/// (scene/motion.hpp).
struct Motion {
    int laps = 1;             // in the duration of the flight; negative: from +Z to +X
    glm::dvec2 radius_m{0.0}; // along the instance's X and Z
    double rise_m = 0.0;      // above and below the plane, twice in a round
    double bank_rad = 0.0;    // rolls into the turn
    bool ahead = true;        // its +Z points along its way; false: it keeps its direction
    int pauses = 0;           // in a round
    double pause_share = 0.0; // of the time
    Beat beat;
};

struct ObjectLod {
    std::string node;
    float error_m = 0.0F;
};

struct Placement {
    glm::dvec3 position{0.0};
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // unit
    glm::dvec3 scale{1.0};                   // along the mesh's axes; negative: mirrored
};

struct Object {
    std::string name, mesh; // mesh: an artifact
    glm::dvec3 center{0.0}; // bounding sphere in the mesh's space
    float radius_m = 1.0F;
    float reach_m = 0.0F; // wind moves no vertex farther, whatever the scale
    bool camera = true, shadow = true, reflection = true, refraction = true; // views that draw it
    std::vector<ObjectLod> lods; // level 0, the finest, comes first
    std::vector<Material> materials;
    std::optional<Motion> motion;
    std::vector<Placement> instances;
    std::vector<std::uint32_t> light_sets; // of each instance; empty: no light reaches any
};

struct ParticleField {
    std::string name;
    glm::dvec3 center{0.0};
    float radius_m = 1.0F;
    int count = 0;
    glm::vec2 size_m{0.05F, 0.1F};    // smallest, largest
    glm::vec2 life_per_s{0.2F, 0.5F}; // slowest, fastest loss of life
    float threshold = 0.1F;           // respawned below this life
    glm::vec3 color{1.0F};            // linear
    bool swarm = false;               // insects that fly around; else sparkles that fade
    float wander_m = 0.0F;            // how far the middle of a swarm strays from `center`

    bool operator==(const ParticleField &) const = default;
};

/// When a sound is heard: seconds of the flight, which may go on past its end.
struct SoundHours {
    double on_s = 0.0;   // begins to fade in
    double off_s = 0.0;  // has faded out
    double fade_s = 1.0; // duration of each fade
};

/// A loop.
struct Sound {
    std::string artifact;
    float volume = 1.0F;
    std::vector<glm::dvec3> places;  // none: heard everywhere; one: a point; more: a line through them
    float radius_m = 1.0F;           // full volume up to this distance
    float falloff = 1.0F;            // beyond, the gain is (radius / distance)^falloff
    std::optional<SoundHours> hours; // none: always
};

/// Loops of which at most one plays.
struct Music {
    std::vector<std::string> artifacts;
    float volume = 1.0F;
    int playing = 0; // at first: 1 is the first; 0: none
};

/// Polynomials with coefficients (a, b, c, d): value(u) = a + b u + c u^2 + d u^3, u in [0, 1].
struct FlightSegment {
    std::array<glm::dvec4, 3> eye{};    // x, y, z; metres
    std::array<glm::dvec4, 3> target{}; // x, y, z; metres
    glm::dvec4 roll{0.0};               // rad
};

struct TimeKnot {
    double time_s = 0.0;
    double position = 0.0; // spline parameter U; the whole part is the segment
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
    int largest_width_px = 1280; // largest picture that the scene was baked for
    int largest_height_px = 720;
    std::optional<FreeCameraBox> free_camera;
    float lod_error_px = 1.0F;
    std::optional<double> vram_mb; // limit of device memory for meshes and textures, 10^6 bytes
    double poster_s = 0.0;
    std::vector<Artifact> artifacts;      // sorted by name
    std::vector<std::uint32_t> streaming; // indices of artifacts in upload order
    Sun sun;
    Ambient ambient;
    Fog fog;
    std::optional<Wind> wind;        // none: nothing moves in it
    std::string sky;                 // cube map artifact; empty: none
    std::vector<DaytimeKey> daytime; // at least two, by rising second; empty: the light stands still
    float moon_diameter_rad = 0.02F;
    std::optional<Clouds> clouds; // only with daytime
    std::vector<PointLight> lights;
    std::vector<LightSet> light_sets{{}}; // the first is empty: no light
    std::optional<Shadow> shadow;
    std::optional<LightShafts> light_shafts;
    std::optional<float> reflection_scale; // relative to the picture's size
    std::optional<float> refraction_scale;
    std::optional<Terrain> terrain;
    std::optional<Water> water;
    std::vector<Object> objects;
    std::vector<ParticleField> particles;
    std::vector<Sound> sounds;
    std::optional<Music> music;
    Flight flight;

    /// True if the bake left out finer data that no view of the flight needs.
    bool is_trimmed() const;

    /// Returns nullptr if there is no artifact of this name.
    const Artifact *find_artifact(std::string_view artifact) const;
};

/// Parses and checks the text of scene.json. Throws Error with file, path, value and limit for another format
/// or version, unknown keys, dangling references, and numbers that are out of range or not finite.
SceneFile parse_scene(std::string_view text, const std::filesystem::path &file);
/// Reads and parses a file. Throws Error also if it cannot be read.
SceneFile read_scene(const std::filesystem::path &file);

} // namespace paradize::assets
