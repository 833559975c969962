#pragma once
// Reads the errors of the player's quality features from tradeoff.json, which `paradize measure` writes
// (pipeline/paradize/formats/FORMAT.md).

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {

struct FeatureError {
    std::string feature, tier;
    double flip = 0.0; // mean over all pictures, 0 to 1
};

/// Returns the points of all groups whose time is a frame time. Throws Error with file, path and value.
std::vector<FeatureError> parse_tradeoff(std::string_view text, const std::filesystem::path &file);

} // namespace paradize::assets
