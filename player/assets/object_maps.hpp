#pragma once
// The maps that an object may have, said once: scene.json, the streamed scene and the objects' pass follow
// this list. pipeline/paradize/maps.py is the pipeline's.

#include <array>
#include <cstddef>
#include <string_view>

namespace paradize::assets {

enum class ObjectMap : std::size_t { color, normal, height, gloss };

/// The members of scene.json that name their artifacts. A shader reads the map NAME as u_NAME where
/// u_has_NAME is 1; its texture unit is its place here.
inline constexpr std::array<std::string_view, 4> object_map_names{"color", "normal", "height", "gloss"};

/// One T for each map.
template <typename T>
class PerMap {
  public:
    T &operator[](ObjectMap map) { return values_[static_cast<std::size_t>(map)]; }
    const T &operator[](ObjectMap map) const { return values_[static_cast<std::size_t>(map)]; }

  private:
    std::array<T, object_map_names.size()> values_{};
};

/// Calls visit(map, name) for each.
template <typename Visit>
void for_each_map(Visit visit) {
    for (std::size_t i = 0; i < object_map_names.size(); ++i) {
        visit(static_cast<ObjectMap>(i), object_map_names[i]);
    }
}

} // namespace paradize::assets
