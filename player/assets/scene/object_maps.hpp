#pragma once
// The maps that a material may have. scene.json, the streamed scene and the objects pass use this list.
// pipeline/paradize/map_table.py is the list of the pipeline.

#include <array>
#include <cstddef>
#include <string_view>

namespace paradize::assets {

/// Those on second texture coordinates come last.
enum class ObjectMap : std::size_t {
    color,
    normal,
    height,
    gloss,
    occlusion,
    emission,
    second_normal,
    second_gloss,
    second_occlusion,
    second_emission
};

/// The members of scene.json that name the artifacts; what follows second_ stands in the table `second`.
/// Shaders sample the map NAME as u_NAME if material.has_NAME is 1.
inline constexpr std::string_view second_prefix = "second_";
inline constexpr std::array<std::string_view, 10> object_map_names{
    "color",         "normal",       "height",           "gloss",          "occlusion", "emission",
    "second_normal", "second_gloss", "second_occlusion", "second_emission"};

/// True for the maps that lie on second texture coordinates.
constexpr bool is_second(ObjectMap map) {
    return map >= ObjectMap::second_normal;
}

/// One value per map.
template <typename T>
class PerMap {
  public:
    T &operator[](ObjectMap map) { return values_[static_cast<std::size_t>(map)]; }
    const T &operator[](ObjectMap map) const { return values_[static_cast<std::size_t>(map)]; }
    bool operator==(const PerMap &) const = default;

  private:
    std::array<T, object_map_names.size()> values_{};
};

/// Calls visit(map, name) for each map.
template <typename Visit>
void for_each_map(Visit visit) {
    for (std::size_t i = 0; i < object_map_names.size(); ++i) {
        visit(static_cast<ObjectMap>(i), object_map_names[i]);
    }
}

} // namespace paradize::assets
