#include "app/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace paradize {

namespace {

constexpr int max_frames = 1000000;
constexpr int max_px = 16384;
constexpr double max_s = 1e9;
constexpr int max_samples = 65536;
constexpr double max_fps = 1000.0;
constexpr double max_mb = 1e9;

template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
    Number value{};
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    return failure == std::errc() && end == text.data() + text.size() ? std::optional<Number>(value)
                                                                      : std::nullopt;
}

[[noreturn]] void refuse(std::string_view option, std::string_view value, const std::string &wanted) {
    throw UsageError(std::string(option) + " " + std::string(value) + ": " + wanted);
}

void parse_size(std::string_view text, Options &out) {
    const std::size_t cross = text.find('x');
    const auto width = parse_number<int>(text.substr(0, cross));
    const auto height =
        cross == std::string_view::npos ? std::nullopt : parse_number<int>(text.substr(cross + 1));
    if (!width || !height || *width < 1 || *height < 1 || *width > max_px || *height > max_px) {
        refuse("--size", text,
               "must be WxH in pixels, each 1 to " + std::to_string(max_px) + ", as in 1280x720");
    }
    out.width_px = width;
    out.height_px = height;
}

std::string listed(std::span<const std::string_view> names) {
    std::string out;
    for (const std::string_view name : names) {
        out += (out.empty() ? "" : ", ") + std::string(name);
    }
    return out;
}

template <typename Name, std::size_t count>
Name parse_name(std::string_view text, const std::array<std::string_view, count> &names, const char *what) {
    const auto found = std::ranges::find(names, text);
    if (found == names.end()) {
        refuse("--quality", text,
               std::string("is not a ").append(what).append("; choose from ") + listed(names));
    }
    return static_cast<Name>(found - names.begin());
}

/// Parses `exact`, `shadow=fast,lod=exact` or both. Later words override earlier ones.
void parse_quality(std::string_view text, Quality &out) {
    while (true) {
        const std::string_view word = text.substr(0, text.find(','));
        const std::size_t equals = word.find('=');
        if (equals == std::string_view::npos) {
            out.fill(parse_name<Tier>(word, tier_names, "tier"));
        } else {
            const auto feature =
                parse_name<QualityFeature>(word.substr(0, equals), feature_names, "quality feature");
            out[static_cast<std::size_t>(feature)] =
                parse_name<Tier>(word.substr(equals + 1), tier_names, "tier");
        }
        if (word.size() == text.size()) {
            return;
        }
        text = text.substr(word.size() + 1);
    }
}

void parse_passes(std::string_view text, std::span<const std::string_view> passes, Options &out) {
    while (true) {
        const std::size_t comma = text.find(',');
        const std::string_view name = text.substr(0, comma);
        if (std::find(passes.begin(), passes.end(), name) == passes.end()) {
            refuse("--disable", name, "is not a pass; choose from " + listed(passes));
        }
        out.disabled.emplace_back(name);
        if (comma == std::string_view::npos) {
            return;
        }
        text = text.substr(comma + 1);
    }
}

} // namespace

Options parse_options(std::span<const char *const> arguments, std::span<const std::string_view> passes) {
    Options out;
    bool quality_given = false;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        std::string_view name = arguments[i];
        std::optional<std::string_view> attached; // --option=value
        if (const std::size_t equals = name.find('=');
            name.starts_with("--") && equals != std::string_view::npos) {
            attached = name.substr(equals + 1);
            name = name.substr(0, equals);
        }
        const auto value = [&]() -> std::string_view {
            if (attached) {
                return *attached;
            }
            if (i + 1 == arguments.size()) {
                throw UsageError(std::string(name) + " needs a value");
            }
            return arguments[++i];
        };
        bool *flag = nullptr;
        if (name == "--headless") {
            flag = &out.headless;
        } else if (name == "--wait-resident") {
            flag = &out.wait_resident;
        } else if (name == "--interactive") {
            flag = &out.interactive;
        } else if (name == "--bench") {
            flag = &out.bench;
        } else if (name == "--json") {
            flag = &out.json;
        } else if (name == "--mute") {
            flag = &out.mute;
        } else if (name == "--panel") {
            flag = &out.panel;
        } else if (name == "--debug") {
            flag = &out.debug;
        } else if (name == "--check-finite") {
            flag = &out.check_finite;
        } else if (name == "--help" || name == "-h") {
            flag = &out.help;
        }
        if (flag != nullptr) {
            if (attached) {
                throw UsageError(std::string(name) + " takes no value");
            }
            *flag = true;
        } else if (name == "--time") {
            const std::string_view text = value();
            const auto seconds = parse_number<double>(text);
            if (!seconds || !std::isfinite(*seconds) || *seconds < 0.0 || *seconds > max_s) {
                refuse(name, text, "must be seconds from the start, 0 to 1e9");
            }
            out.time_s = *seconds;
        } else if (name == "--frames") {
            const std::string_view text = value();
            out.frames = parse_number<int>(text);
            if (!out.frames || *out.frames < 1 || *out.frames > max_frames) {
                refuse(name, text, "must be a whole number, 1 to " + std::to_string(max_frames));
            }
        } else if (name == "--size") {
            parse_size(value(), out);
        } else if (name == "--screenshot") {
            out.screenshot = value();
            if (out.screenshot.extension() != ".png") {
                refuse(name, out.screenshot.string(), "must be a file name that ends in .png");
            }
        } else if (name == "--audio") {
            out.audio = value();
            if (out.audio.extension() != ".wav") {
                refuse(name, out.audio.string(), "must be a file name that ends in .wav");
            }
        } else if (name == "--quality") {
            parse_quality(value(), out.quality);
            quality_given = true;
        } else if (name == "--reference") {
            const std::string_view text = value();
            out.reference = parse_number<int>(text);
            if (!out.reference || *out.reference < 1 || *out.reference > max_samples) {
                refuse(name, text, "must be a whole number of frames, 1 to " + std::to_string(max_samples));
            }
        } else if (name == "--fps") {
            const std::string_view text = value();
            out.fps = parse_number<double>(text);
            if (!out.fps || !(*out.fps > 0.0) || *out.fps > max_fps) {
                refuse(name, text, "must be frames a second, above 0 and up to 1000");
            }
        } else if (name == "--vram" || name == "--ram") {
            const std::string_view text = value();
            const auto megabytes = parse_number<double>(text);
            if (!megabytes || !(*megabytes >= 1.0) || *megabytes > max_mb) {
                refuse(name, text, "must be megabytes, 1 to 1e9");
            }
            (name == "--vram" ? out.vram_mb : out.ram_mb) = megabytes;
        } else if (name == "--order") {
            const std::string_view text = value();
            if (text != "needs" && text != "file") {
                refuse(name, text, "must be needs or file");
            }
            out.file_order = text == "file";
        } else if (name == "--disable") {
            parse_passes(value(), passes, out);
        } else if (name.starts_with("-") && name.size() > 1) {
            throw UsageError("unknown option " + std::string(name));
        } else if (!out.folder.empty()) {
            throw UsageError("one scene folder at a time: " + out.folder.string() + " or " +
                             std::string(name) + "?");
        } else {
            out.folder = name;
        }
    }
    if (out.folder.empty() && !out.help) {
        throw UsageError(
            "no scene folder; give the one that `paradize bake` wrote, such as build/assets/island");
    }
    if (out.interactive && (out.headless || !out.screenshot.empty())) {
        throw UsageError("--interactive needs a window: leave out --headless and --screenshot");
    }
    if (out.bench && (out.interactive || out.check_finite || !out.screenshot.empty())) {
        throw UsageError("--bench only measures frames: leave out --interactive, --screenshot and "
                         "--check-finite");
    }
    if (!out.audio.empty() && (out.interactive || out.bench || out.mute)) {
        throw UsageError(
            "--audio writes the sound of the flight: leave out --interactive, --bench and --mute");
    }
    if (!out.audio.empty() && out.screenshot.empty() && out.json) {
        throw UsageError(
            "--audio alone draws nothing that --json reports: add --screenshot, or leave one out");
    }
    if (out.reference && (out.screenshot.empty() || out.fps || quality_given)) {
        throw UsageError(
            "--reference renders one picture at the finest settings: add --screenshot, leave out "
            "--quality and --fps");
    }
    if (out.fps && (quality_given || out.bench)) {
        throw UsageError("--fps chooses the quality itself: leave out --quality and --bench");
    }
    if (out.file_order && out.vram_mb) {
        throw UsageError(
            "--order file uploads everything, --vram only what the picture needs most: leave out "
            "one of them");
    }
    if (out.panel && out.headless) {
        throw UsageError("--panel is the title of the window: leave out --headless");
    }
    if (out.interactive && out.frames) {
        throw UsageError("--interactive ends with Escape, not after a number of frames: leave out --frames");
    }
    return out;
}

std::string usage(std::span<const std::string_view> passes) {
    return "paradize-player DIR [--headless] [--time S] [--frames N] [--size WxH] [--screenshot F.png]\n"
           "                    [--audio F.wav] [--quality T|FEATURE=T,...] [--reference N] [--fps N] "
           "[--disable PASS,...]\n"
           "                    [--vram MB] [--ram MB] [--order O] [--wait-resident] [--interactive] "
           "[--bench]\n"
           "                    [--json] [--panel] [--mute] [--debug] [--check-finite]\n"
           "\n"
           "Plays a baked scene. Any key ends playback.\n"
           "  --headless         no window and no sound; draws one frame, or --frames\n"
           "  --time S           start at this second of the flight\n"
           "  --frames N         draw N frames, 1/30 s apart, and end\n"
           "  --size WxH         size of the picture in pixels (default: the scene's)\n"
           "  --screenshot F.png draw one frame with all data resident into this file; with --frames N\n"
           "                     the files F_0000.png, F_0001.png ..., while the scene streams in\n"
           "  --audio F.wav      write the flight's sound, or that of --frames N, into this file, and end; "
           "with\n"
           "                     --screenshot after it the pictures\n"
           "  --quality T        speed against exactness: " +
           listed(tier_names) + " (default: balanced); or for each of\n                     " +
           listed(feature_names) +
           ":\n"
           "                     --quality shadow=fast,lod=exact\n"
           "  --reference N      the screenshot is the mean of N frames at the finest settings: the picture\n"
           "                     that qualities are compared with\n"
           "  --fps N            measure, choose the qualities that reach N frames a second with the least "
           "error,\n"
           "                     and keep to them\n"
           "  --disable PASS,... leave passes out: " +
           listed(passes) +
           "\n"
           "  --vram MB          memory for meshes and textures on the device; what the picture needs least "
           "is\n"
           "                     left out (default: the scene's vram_mb, or no limit)\n"
           "  --ram MB           memory for files that wait for upload (default: 268)\n"
           "  --order O          what is uploaded first: needs (default), what the picture needs most; file, "
           "the\n"
           "                     order of scene.json, to compare with\n"
           "  --wait-resident    upload everything before the first frame\n"
           "  --interactive      fly yourself: W A S D Q E, mouse, Z X roll, Shift is faster, Space pauses,\n"
           "                     M mutes, N next music, - and + volume, Escape ends\n"
           "  --bench            measure 100 frames (or --frames) with all data resident: median and 95th\n"
           "                     percentile\n"
           "  --json             print one JSON object about the run\n"
           "  --panel            the window's title says what is resident, needed and missing\n"
           "  --mute             no sound\n"
           "  --debug            errors reported by the graphics driver are fatal\n"
           "  --check-finite     a NaN or infinity in the picture is fatal\n";
}

} // namespace paradize
