#pragma once
// Parses the command line.

#include "scene/quality.hpp"

#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace paradize {

/// Wrong usage. The exit code is 2.
class UsageError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct Options {
    std::filesystem::path folder; // folder of the baked scene
    bool headless = false;
    double time_s = 0.0;
    std::optional<int> frames;
    std::optional<int> width_px, height_px; // both or none
    std::filesystem::path screenshot;       // empty: no screenshot
    std::filesystem::path audio;            // WAV file for the flight's sound; empty: none
    std::vector<std::string> disabled;
    Quality quality = all_at(Tier::balanced);
    std::optional<int> reference;          // number of frames averaged per picture
    std::optional<double> fps;             // target frame rate
    std::optional<double> vram_mb, ram_mb; // limits of memory, 10^6 bytes
    bool file_order = false;               // upload in the order of scene.json
    bool wait_resident = false;
    bool interactive = false;
    bool bench = false;
    bool json = false;
    bool panel = false; // the window's title says how streaming stands
    bool mute = false;
    bool debug = false;        // errors reported by the driver are fatal
    bool check_finite = false; // NaN or infinity in the linear picture is fatal
    std::string help;          // the text of --help where it is asked for
};

/// `passes` are the names that --disable accepts. Throws UsageError.
Options parse_options(std::span<const char *const> arguments, std::span<const std::string_view> passes);

} // namespace paradize
