#pragma once
// The data and the text of --json, --bench and --fps.

#include "app/frame_rate.hpp"
#include "passes/pass_meter.hpp"
#include "streaming/streamer.hpp"
#include "streaming/terrain_tiles.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace paradize {

/// Results of --fps.
struct FrameRate {
    double wanted = 0.0; // target, frames per second
    Quality quality{};   // of the last frame
    double predicted_ms = 0.0;
    double median_ms = 0.0; // of the frames since the last change of quality
    int changes = 0;        // changes since the first choice
    FeatureCosts table{};   // the calibration
};

/// How streaming stood when a frame was finished.
struct StreamingMoment {
    double s = 0.0;                   // since the player was started
    float worst_error = 0.0F;         // as in StreamingCounts
    double stream_ms = 0.0;           // processor time of the thread that draws, for streaming in this frame
    std::uint64_t uploaded_bytes = 0; // since the scene was loaded
};

struct Report {
    int width_px = 0, height_px = 0;
    std::vector<double> frame_ms; // drawing time of each frame, until the device has finished
    std::vector<double> scene_ms; // processor time of each frame for finding what to draw
    bool bench = false;           // true: frame_ms was measured by --bench
    std::vector<std::pair<std::string, double>> passes_ms; // of --bench, in drawing order
    MeterClock passes_clock = MeterClock::processor;       // that measured them
    Quality quality = all_at(Tier::balanced);
    std::vector<QualityFeature> features; // that apply to this scene on this device
    std::optional<int> reference;         // number of frames averaged per picture
    std::optional<FrameRate> fps;
    std::uint64_t draw_calls = 0, most_draw_calls = 0; // of the last frame, and of any, in all views
    StreamingCounts streaming;
    std::vector<StreamingMoment> moments; // one per frame of --frames; else of the first frame only
    std::optional<TerrainCounts> terrain; // of the last frame
    std::string renderer, version;
    std::vector<std::string> screenshots;
    std::vector<std::string> exceeded_limits; // messages of BakeLimits
};

/// Returns the smallest value that at least this `share` (0 to 1, above 0) of the values does not exceed. 0
/// if there are no values.
double percentile(std::vector<double> values, double share);

/// Returns the middle value, or 0 if there are no values.
double median(std::vector<double> values);

/// Peak resident memory of this process, bytes.
std::uint64_t peak_rss_bytes();

/// Size of the player's executable, bytes. 0 if it cannot be read. The release build is stripped.
std::uint64_t program_bytes();

/// File names of all loaded shared libraries, sorted. The graphics driver's libraries are included.
std::vector<std::string> shared_libraries();

/// Returns a warning if the terrain takes more than 2 GiB of device memory, else an empty text.
std::string terrain_warning(std::uint64_t bytes);

/// Returns a line for the window's title: the scene and how its streaming stands.
std::string panel_line(const std::string &scene, const StreamingCounts &counts);

/// Returns one line: the target, whether it is reached, and the chosen qualities.
std::string fps_line(const FrameRate &fps);

/// Returns one line with the frame times of --bench.
std::string bench_line(const Report &report);

/// Returns one JSON object on one line.
std::string to_json(const Report &report);

/// Returns the JSON object of a run that failed: `{"error": [MESSAGE]}`, as the pipeline prints.
std::string error_json(const std::string &message);

} // namespace paradize
