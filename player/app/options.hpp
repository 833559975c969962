#pragma once
// The command line.

#include "scene/quality.hpp"

#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace paradize {

/// Wrong usage: exit code 2.
class UsageError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct Options {
    std::filesystem::path folder; // of the baked scene
    bool headless = false;
    double time_s = 0.0;
    std::optional<int> frames;
    std::optional<int> width_px, height_px; // both or none
    std::filesystem::path screenshot;       // empty: none
    std::vector<std::string> disabled;
    Quality quality = all_at(Tier::balanced);
    std::optional<int> reference; // frames that a picture averages
    std::optional<double> fps;    // that the qualities are chosen for
    bool wait_resident = false;
    bool interactive = false;
    bool bench = false;
    bool json = false;
    bool mute = false;
    bool debug = false;        // the driver's complaints are errors
    bool check_finite = false; // a NaN in the linear picture is an error
    bool help = false;
};

/// Throws UsageError. `passes` are the names that --disable takes.
Options parse_options(std::span<const char *const> arguments, std::span<const std::string_view> passes);

std::string usage(std::span<const std::string_view> passes);

} // namespace paradize
