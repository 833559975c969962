#pragma once
// Of tradeoff.json, which `paradize measure` writes (pipeline/paradize/formats/FORMAT.md): what the player's
// own trades err.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {

struct FeatureError {
    std::string feature, tier;
    double flip = 0.0; // mean over the pictures, 0 to 1
};

/// The points of all groups of frame time. Throws Error with file, place and value.
std::vector<FeatureError> parse_tradeoff(std::string_view text, const std::filesystem::path &file);

} // namespace paradize::assets
