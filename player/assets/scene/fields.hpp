#pragma once
// Helpers for the readers of scene.json: numbers as floats and vectors, references to artifacts.

#include "assets/json_reader.hpp"
#include "assets/limits.hpp"
#include "assets/scene/file.hpp"

namespace paradize::assets {

inline constexpr double max_radiance = 1e7; // limit of radiances
inline constexpr double min_flight_s = 1e-3, max_flight_s = 86400.0;
inline constexpr std::size_t max_entries = 100000;

float real(const JsonObject &from, std::string_view key, double low, double high);
float real_or(const JsonObject &from, std::string_view key, double low, double high, float fallback);
glm::vec2 pair(const JsonObject &from, std::string_view key, double low, double high);
glm::vec3 triple(const JsonObject &from, std::string_view key, double low, double high);
/// A position in the world or in a mesh's space, metres.
glm::dvec3 position(const JsonObject &from, std::string_view key);

/// Returns the name of the artifact that `key` refers to, which must be of this kind. Empty if the member is
/// absent or null.
std::string optional_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind);
/// The same, but the member is required.
std::string required_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind);

/// Returns the light sets of `count` things, one each. Empty if the member is absent or null. The lights must
/// have been read before.
std::vector<std::uint32_t> light_sets_of(const SceneFile &scene, const JsonObject &from, std::size_t count);

// In lights.cpp, daytime_keys.cpp, ripples.cpp, terrain.cpp and objects.cpp. Each reads its
// members of the root into `out`. The artifacts must have been read before.
void read_lights(const JsonObject &root, SceneFile &out);
void read_ripples(const JsonObject &water, Water &out);
void read_terrain(const JsonObject &root, SceneFile &out);
void read_objects(const JsonObject &root, SceneFile &out);
void read_particles(const JsonObject &root, SceneFile &out);
void read_sounds(const JsonObject &root, SceneFile &out);
void read_flight(const JsonObject &root, SceneFile &out);
/// After the flight, whose seconds the keys name.
void read_daytime(const JsonObject &root, SceneFile &out);
Ambient read_ambient(const JsonObject &from);
Fog read_fog(const JsonObject &from);

} // namespace paradize::assets
