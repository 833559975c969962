#include "assets/scene/fields.hpp"

namespace paradize::assets {

float real(const JsonObject &from, std::string_view key, double low, double high) {
    return static_cast<float>(from.number(key, low, high));
}

float real_or(const JsonObject &from, std::string_view key, double low, double high, float fallback) {
    return static_cast<float>(from.number_or(key, low, high, static_cast<double>(fallback)));
}

glm::vec2 pair(const JsonObject &from, std::string_view key, double low, double high) {
    const std::vector<double> v = from.numbers(key, 2, low, high);
    return {static_cast<float>(v[0]), static_cast<float>(v[1])};
}

glm::vec3 triple(const JsonObject &from, std::string_view key, double low, double high) {
    const std::vector<double> v = from.numbers(key, 3, low, high);
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

glm::dvec3 position(const JsonObject &from, std::string_view key) {
    const std::vector<double> v = from.numbers(key, 3, -max_position_m, max_position_m);
    return {v[0], v[1], v[2]};
}

std::string optional_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind) {
    std::string name = from.text_or(key, "");
    if (!name.empty()) {
        const Artifact *artifact = scene.find_artifact(name);
        if (artifact == nullptr || artifact->kind != kind) {
            from.fail(key, "names \"" + name + "\", which is not an artifact of the right kind");
        }
    }
    return name;
}

std::string required_artifact(const SceneFile &scene, const JsonObject &from, std::string_view key,
                              ArtifactKind kind) {
    std::string name = optional_artifact(scene, from, key, kind);
    if (name.empty()) {
        from.fail(key, "is missing");
    }
    return name;
}

} // namespace paradize::assets
