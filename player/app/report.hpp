#pragma once
// What --json prints.

#include "app/frame_rate.hpp"
#include "streaming/terrain_tiles.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace paradize {

/// What --fps came to.
struct FrameRate {
    double wanted = 0.0; // frames a second
    Quality quality{};   // of the last frame
    double predicted_ms = 0.0;
    double median_ms = 0.0; // of the frames since the last change
    int changes = 0;        // since the first choice
    FeatureCosts table{};   // as calibrated
};

struct Report {
    int width_px = 0, height_px = 0;
    std::vector<double> frame_ms; // drawing of each frame until the device has finished it
    bool bench = false;           // they were measured by --bench
    std::vector<std::pair<std::string, double>> passes_ms; // of --bench, in drawing order
    Quality quality = all_at(Tier::balanced);
    std::vector<QualityFeature> features; // that do something for this scene on this device
    std::optional<int> reference;         // frames that each picture averages
    std::optional<FrameRate> fps;
    std::uint64_t resident_bytes = 0;
    std::uint64_t total_bytes = 0;
    std::uint64_t terrain_bytes = 0;      // of the total
    std::optional<TerrainCounts> terrain; // of the last frame
    std::string renderer, version;
    std::vector<std::string> screenshots;
    std::vector<std::string> exceeded_limits; // what of the bake's limits was exceeded, in words
};

/// The smallest value that at least this share (above 0, up to 1) of them does not exceed; 0 when there is
/// none.
double percentile(std::vector<double> values, double share);

/// Middle value; 0 when there is none.
double median(std::vector<double> values);

/// Largest memory of this process so far, bytes.
std::uint64_t peak_rss_bytes();

/// Bytes of the program's own file (the release build is stripped); 0 when it cannot be asked.
std::uint64_t program_bytes();

/// File names of the shared libraries that are loaded now, the graphics driver's among them, sorted.
std::vector<std::string> shared_libraries();

/// What is to be told of a terrain that takes so many bytes of the device; nothing of up to 2 GiB.
std::string terrain_warning(std::uint64_t bytes);

/// What --fps says in words, one line: what was chosen, and whether it reaches the rate.
std::string fps_line(const FrameRate &fps);

/// What --bench says in words, one line.
std::string bench_line(const Report &report);

/// One JSON object, one line.
std::string to_json(const Report &report);

} // namespace paradize
