#include "app/options.hpp"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>

namespace paradize {

namespace {

constexpr int max_frames = 1000000;
constexpr int max_px = 16384;
constexpr double max_s = 1e9;
constexpr int max_samples = 65536;
constexpr double min_fps = 1e-9;
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

/// Returns what parses a number from `least` to `most` into `out`, and says whether the text is one.
template <typename Number, typename Out>
auto number(Out &out, Number least, Number most) {
    return [&out, least, most](std::string_view text) {
        const auto value = parse_number<Number>(text);
        const bool inside = value && *value >= least && *value <= most; // not for NaN
        if (inside) {
            out = *value;
        }
        return inside;
    };
}

bool parse_size(std::string_view text, Options &out) {
    const std::size_t cross = text.find('x');
    return cross != std::string_view::npos && number(out.width_px, 1, max_px)(text.substr(0, cross)) &&
           number(out.height_px, 1, max_px)(text.substr(cross + 1));
}

/// Returns what takes the name of a file with this extension.
auto file_name(std::filesystem::path &out, const char *extension) {
    return [&out, extension](std::string_view text) {
        out = text;
        return out.extension() == extension;
    };
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

/// Calls `take` with each word of a list that commas separate.
template <typename Take>
void for_each_word(std::string_view text, const Take &take) {
    for (std::size_t comma; (comma = text.find(',')) != std::string_view::npos;) {
        take(text.substr(0, comma));
        text.remove_prefix(comma + 1);
    }
    take(text);
}

/// Parses `exact` or `shadow=fast`. Later words override earlier ones.
void parse_quality(std::string_view word, Quality &out) {
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) {
        out.fill(parse_name<Tier>(word, tier_names, "tier"));
        return;
    }
    const auto feature = parse_name<QualityFeature>(word.substr(0, equals), feature_names, "quality feature");
    out[static_cast<std::size_t>(feature)] = parse_name<Tier>(word.substr(equals + 1), tier_names, "tier");
}

void parse_pass(std::string_view name, std::span<const std::string_view> passes, Options &out) {
    if (std::ranges::find(passes, name) == passes.end()) {
        refuse("--disable", name, "is not a pass; choose from " + listed(passes));
    }
    out.disabled.emplace_back(name);
}

/// Throws for options that exclude or need each other.
void require_consistent(const Options &given, bool quality_given) {
    const bool pictures = !given.screenshot.empty();
    const bool sound = !given.audio.empty();
    const std::pair<bool, const char *> rules[] = {
        {given.folder.empty(),
         "no scene folder; give the one that `paradize bake` wrote, such as build/assets/island"},
        {given.interactive && (given.headless || pictures),
         "--interactive needs a window: leave out --headless and --screenshot"},
        {given.bench && (given.interactive || given.check_finite || pictures),
         "--bench only measures frames: leave out --interactive, --screenshot and --check-finite"},
        {sound && (given.interactive || given.bench || given.mute),
         "--audio writes the sound of the flight: leave out --interactive, --bench and --mute"},
        {sound && !pictures && given.json,
         "--audio alone draws nothing that --json reports: add --screenshot, or leave one out"},
        {given.reference && (!pictures || given.fps || quality_given),
         "--reference renders one picture at the finest settings: add --screenshot, leave out --quality and "
         "--fps"},
        {given.fps && (quality_given || given.bench),
         "--fps chooses the quality itself: leave out --quality and --bench"},
        {given.file_order && given.vram_mb,
         "--order file uploads everything, --vram only what the picture needs most: leave out one of them"},
        {given.panel && given.headless, "--panel is the title of the window: leave out --headless"},
        {given.interactive && given.frames,
         "--interactive ends with Escape, not after a number of frames: leave out --frames"},
    };
    for (const auto &[broken, message] : rules) {
        if (broken) {
            throw UsageError(message);
        }
    }
}

} // namespace

Options parse_options(std::span<const char *const> arguments, std::span<const std::string_view> passes) {
    Options out;
    CLI::App app("Plays a baked scene. Any key ends playback.", "paradize-player");
    app.get_formatter()->column_width(26);
    app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    const CLI::Validator no_value(
        [](const std::string &text) { return text == "true" ? "" : "takes no value"; }, "");
    const auto flag = [&app, &no_value](const char *name, bool &value, const char *help) {
        app.add_flag(name, value, help)->check(no_value);
    };
    // parse: takes the option's text, says whether it is valid. must_be: what the message says if it is not
    const auto option = [&app](const char *name, const char *shown, auto parse, const std::string &must_be,
                               const std::string &help) {
        const auto take = [name, parse, must_be](const std::string &text) {
            if (!parse(text)) {
                refuse(name, text, "must be " + must_be);
            }
        };
        return app.add_option_function<std::string>(name, take, help)->type_name(shown);
    };
    const std::string up_to = ", 1 to ";
    app.add_option("DIR", out.folder, "folder of the baked scene, or its scene.json")->type_name("");
    flag("--headless", out.headless, "no window and no sound; draws one frame, or --frames");
    option("--time", "S", number(out.time_s, 0.0, max_s), "seconds from the start, 0 to 1e9",
           "start at this second of the flight");
    option("--frames", "N", number(out.frames, 1, max_frames),
           "a whole number" + up_to + std::to_string(max_frames), "draw N frames, 1/30 s apart, and end");
    option(
        "--size", "WxH", [&out](std::string_view text) { return parse_size(text, out); },
        "WxH in pixels, each 1 to " + std::to_string(max_px) + ", as in 1280x720",
        "size of the picture in pixels (default: the scene's)");
    option("--screenshot", "F.png", file_name(out.screenshot, ".png"), "a file name that ends in .png",
           "draw one frame with all data resident into this file; with --frames N\n"
           "the files F_0000.png, F_0001.png ..., while the scene streams in");
    option("--audio", "F.wav", file_name(out.audio, ".wav"), "a file name that ends in .wav",
           "write the flight's sound, or that of --frames N, into this file, and end;\n"
           "with --screenshot after it the pictures");
    bool quality_given = false;
    const auto take_quality = [&out, &quality_given](const std::string &text) {
        quality_given = true;
        for_each_word(text, [&](std::string_view word) { parse_quality(word, out.quality); });
    };
    app.add_option_function<std::string>("--quality", take_quality,
                                         "speed against exactness: " + listed(tier_names) +
                                             " (default: balanced); or for each of\n" +
                                             listed(feature_names) + ":\n--quality shadow=fast,lod=exact")
        ->type_name("T")
        ->trigger_on_parse(); // each time it is given
    option("--reference", "N", number(out.reference, 1, max_samples),
           "a whole number of frames" + up_to + std::to_string(max_samples),
           "the screenshot is the mean of N frames at the finest settings: the picture\n"
           "that qualities are compared with");
    option("--fps", "N", number(out.fps, min_fps, max_fps), "frames a second, above 0 and up to 1000",
           "measure, choose the qualities that reach N frames a second with the least\n"
           "error, and keep to them");
    const auto take_passes = [&out, passes](const std::string &text) {
        for_each_word(text, [&](std::string_view name) { parse_pass(name, passes, out); });
    };
    app.add_option_function<std::string>("--disable", take_passes, "leave passes out: " + listed(passes))
        ->type_name("PASS,...")
        ->trigger_on_parse();
    option("--vram", "MB", number(out.vram_mb, 1.0, max_mb), "megabytes, 1 to 1e9",
           "memory for meshes and textures on the device; what the picture needs\n"
           "least is left out (default: the scene's vram_mb, or no limit)");
    option("--ram", "MB", number(out.ram_mb, 1.0, max_mb), "megabytes, 1 to 1e9",
           "memory for files that wait for upload (default: 268)");
    option(
        "--order", "O",
        [&out](std::string_view text) {
            out.file_order = text == "file";
            return text == "needs" || out.file_order;
        },
        "needs or file",
        "what is uploaded first: needs (default), what the picture needs most; file,\n"
        "the order of scene.json, to compare with");
    flag("--wait-resident", out.wait_resident, "upload everything before the first frame");
    flag("--interactive", out.interactive,
         "fly yourself: W A S D Q E, mouse, Z X roll, Shift is faster, Space pauses,\n"
         "M mutes, N next music, - and + volume, Escape ends");
    flag("--bench", out.bench,
         "measure 100 frames (or --frames) with all data resident: median and 95th\npercentile");
    flag("--json", out.json, "print one JSON object about the run");
    flag("--panel", out.panel, "the window's title says what is resident, needed and missing");
    flag("--mute", out.mute, "no sound");
    flag("--debug", out.debug, "errors reported by the graphics driver are fatal");
    flag("--check-finite", out.check_finite, "a NaN or infinity in the picture is fatal");
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend())); // the last one first
    } catch (const CLI::CallForHelp &) {
        out.help = app.help();
        return out;
    } catch (const CLI::ParseError &error) {
        throw UsageError(error.what());
    }
    require_consistent(out, quality_given);
    std::error_code unknown; // what cannot be looked at is reported when it is opened
    if (out.folder.filename() == "scene.json" && std::filesystem::is_regular_file(out.folder, unknown)) {
        out.folder = out.folder.has_parent_path() ? out.folder.parent_path() : ".";
    }
    return out;
}

} // namespace paradize
