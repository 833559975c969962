#pragma once
// Of tradeoff.json, which `paradize measure` writes (pipeline/paradize/formats/FORMAT.md): what the player's
// own trades err.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {

struct TradeError {
    std::string trade, tier;
    double flip = 0.0; // mean over the pictures, 0 to 1
};

/// The points of all groups of frame time. Throws Error with file, place and value.
std::vector<TradeError> parse_trades(std::string_view text, const std::filesystem::path &file);

} // namespace paradize::assets
