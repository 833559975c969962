#include "assets/tradeoff_file.hpp"

#include "assets/json_reader.hpp"

namespace paradize::assets {

namespace {
constexpr std::size_t max_groups = 100000;
constexpr std::size_t max_tradeoff_points = 1000;
} // namespace

std::vector<FeatureError> parse_tradeoff(std::string_view text, const std::filesystem::path &file) {
    const JsonDocument document(text, file.string());
    std::vector<FeatureError> out;
    for (const JsonObject &group : document.root().objects("groups", max_groups)) {
        if (group.text_or("time", "") != "frame") {
            continue;
        }
        for (const JsonObject &point : group.objects("points", max_tradeoff_points)) {
            out.push_back(
                {group.text("name"), point.text("tier"), point.object("error").number("mean", 0.0, 1.0)});
        }
    }
    return out;
}

} // namespace paradize::assets
