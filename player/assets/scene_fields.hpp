#pragma once
// What the readers of scene.json's parts share: numbers as floats and vectors, references to artifacts.

#include "assets/json_reader.hpp"
#include "assets/scene_file.hpp"

namespace paradize::assets {

inline constexpr double max_length_m = 1e7;    // no length of a scene is larger
inline constexpr double max_position_m = 1e10; // no coordinate of a place is
inline constexpr double max_radiance = 1e7;    // no radiance is larger
inline constexpr std::size_t max_entries = 100000;

float real(const JsonObject &from, std::string_view key, double low, double high);
float real_or(const JsonObject &from, std::string_view key, double low, double high, float fallback);
glm::vec2 pair(const JsonObject &from, std::string_view key, double low, double high);
glm::vec3 triple(const JsonObject &from, std::string_view key, double low, double high);
/// A place in the world or in a mesh's space, metres.
glm::dvec3 position(const JsonObject &from, std::string_view key);

/// The artifact that `key` names, of this kind; empty when the member is absent or null.
std::string optional_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind);
/// The same, and an error when it is absent or null.
std::string required_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind);

// In scene_terrain.cpp and scene_things.cpp; each reads its members of the root into `out`, whose artifacts
// are known already.
void read_terrain(const JsonObject &root, SceneFile &out);
void read_objects(const JsonObject &root, SceneFile &out);
void read_particles(const JsonObject &root, SceneFile &out);
void read_sound(const JsonObject &root, SceneFile &out);
void read_flight(const JsonObject &root, SceneFile &out);

} // namespace paradize::assets
