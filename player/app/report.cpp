#include "app/report.hpp"

#include "app/messages.hpp"
#include "number_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <link.h>
#include <sys/resource.h>

namespace paradize {

namespace {

std::string quoted(const std::string &raw) {
    const std::string text = printable(raw);
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            char escape[8];
            std::snprintf(escape, sizeof escape, "\\u%04x",
                          static_cast<unsigned>(static_cast<unsigned char>(c)));
            out += escape;
        } else {
            out += c;
        }
    }
    return out + "\"";
}

std::string quoted(const std::vector<std::string> &texts) {
    std::string out = "[";
    for (const std::string &text : texts) {
        out += (out.size() == 1 ? "" : ", ") + quoted(text);
    }
    return out + "]";
}

std::string quoted(const Quality &quality) {
    std::string out = "{";
    for (std::size_t i = 0; i < feature_count; ++i) {
        out += (out.size() == 1 ? "" : ", ") + quoted(std::string(feature_names[i])) + ": " +
               quoted(std::string(tier_names[static_cast<std::size_t>(quality[i])]));
    }
    return out + "}";
}

std::string fps_json(const FrameRate &fps, std::span<const QualityFeature> features) {
    char numbers[256];
    std::snprintf(
        numbers, sizeof numbers,
        "{\"wanted\": %g, \"budget_ms\": %.3f, \"median_ms\": %.3f, \"predicted_ms\": %.3f, \"reached\": %s, "
        "\"changes\": %d, \"calibration\": {",
        fps.wanted, 1000.0 / fps.wanted, fps.median_ms, fps.predicted_ms,
        fps.median_ms <= 1000.0 / fps.wanted ? "true" : "false", fps.changes);
    std::string out = numbers;
    for (const QualityFeature feature : features) {
        const auto &row = fps.table[static_cast<std::size_t>(feature)];
        out += (out.back() == '{' ? "\"" : ", \"") +
               std::string(feature_names[static_cast<std::size_t>(feature)]) + "\": {";
        for (std::size_t tier = 0; tier < tier_names.size(); ++tier) {
            std::snprintf(numbers, sizeof numbers, "%s\"%s\": {\"ms\": %.3f, \"flip\": %.5f}",
                          tier == 0 ? "" : ", ", std::string(tier_names[tier]).c_str(), row[tier].ms,
                          row[tier].error);
            out += numbers;
        }
        out += "}";
    }
    return out + "}}";
}

} // namespace

std::string error_json(const std::string &message) {
    return "{\"error\": " + quoted(std::vector{message}) + "}";
}

double percentile(std::vector<double> values, double share) {
    if (values.empty()) {
        return 0.0;
    }
    const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size())));
    const auto place = values.begin() + std::max<std::ptrdiff_t>(rank, 1) - 1;
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

double median(std::vector<double> values) {
    if (values.empty()) {
        return 0.0;
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::uint64_t peak_rss_bytes() {
    struct rusage usage {};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t program_bytes() {
    std::error_code failure;
    const std::uintmax_t bytes = std::filesystem::file_size("/proc/self/exe", failure);
    return failure ? 0 : bytes;
}

std::vector<std::string> shared_libraries() {
    std::vector<std::string> out;
    ::dl_iterate_phdr(
        [](dl_phdr_info *info, std::size_t /*bytes*/, void *names) {
            // The program itself has an empty name, and the kernel's vDSO has no folder.
            if (const std::string_view path = info->dlpi_name; path.find('/') != std::string_view::npos) {
                static_cast<std::vector<std::string> *>(names)->emplace_back(
                    path.substr(path.rfind('/') + 1));
            }
            return 0;
        },
        &out);
    std::sort(out.begin(), out.end());
    return out;
}

std::string terrain_warning(std::uint64_t bytes) {
    constexpr std::uint64_t most = std::uint64_t{2} << 30U;
    if (bytes <= most) {
        return "";
    }
    return "the terrain's tiles take " + std::to_string(bytes >> 20U) + " MiB of device memory, more than " +
           std::to_string(most >> 20U) +
           " MiB, and stay resident during playback; raise the terrain's `max_error_m` or "
           "`lod_error_px` in the scene, or set `quantise`, and bake it again";
}

std::string panel_line(const std::string &scene, const StreamingCounts &counts) {
    const auto megabytes = [](std::uint64_t bytes) { return fixed(static_cast<double>(bytes) / 1e6, 1); };
    return scene + ": " + megabytes(counts.resident_bytes) + " of " + megabytes(counts.total_bytes) +
           " MB resident, " + megabytes(counts.needed_bytes) + " MB needed, " +
           std::to_string(counts.evictions) + " evictions, " +
           (counts.worst_error > 0.0F
                ? "worst error " + fixed(static_cast<double>(counts.worst_error), 2) + " x the accepted one"
                : "nothing missing") +
           ", " + fixed(counts.read_bytes_per_s / 1e6, 0) + " MB/s read";
}

std::string fps_line(const FrameRate &fps) {
    const double budget_ms = 1000.0 / fps.wanted;
    char numbers[200];
    std::snprintf(numbers, sizeof numbers, "%g frames a second (%.3f ms): %s, %.3f ms with ", fps.wanted,
                  budget_ms, fps.median_ms <= budget_ms ? "reached" : "not reached", fps.median_ms);
    return numbers + to_text(fps.quality);
}

std::string bench_line(const Report &report) {
    char numbers[160];
    std::snprintf(numbers, sizeof numbers, "%zu frames of %d x %d: median %.3f ms, 95th percentile %.3f ms, ",
                  report.frame_ms.size(), report.width_px, report.height_px, median(report.frame_ms),
                  percentile(report.frame_ms, 0.95));
    return numbers + printable(report.renderer);
}

std::string to_json(const Report &report) {
    char numbers[512];
    std::snprintf(numbers, sizeof numbers,
                  "{\"frames\": %zu, \"width\": %d, \"height\": %d, \"frame_ms\": %.3f, \"scene_ms\": %.3f, "
                  "\"resident_bytes\": %llu, "
                  "\"total_bytes\": %llu, \"peak_rss_bytes\": %llu",
                  report.frame_ms.size(), report.width_px, report.height_px, median(report.frame_ms),
                  median(report.scene_ms), static_cast<unsigned long long>(report.streaming.resident_bytes),
                  static_cast<unsigned long long>(report.streaming.total_bytes),
                  static_cast<unsigned long long>(peak_rss_bytes()));
    std::string out = numbers;
    if (report.bench) {
        std::snprintf(
            numbers, sizeof numbers,
            ", \"bench\": {\"median_ms\": %.3f, \"p95_ms\": %.3f, \"low_ms\": %.3f, \"high_ms\": %.3f, "
            "\"passes_ms\": {",
            median(report.frame_ms), percentile(report.frame_ms, 0.95), percentile(report.frame_ms, 0.25),
            percentile(report.frame_ms, 0.75));
        out += numbers;
        for (const auto &[name, ms] : report.passes_ms) {
            std::snprintf(numbers, sizeof numbers, ": %.3f", ms);
            out += (out.back() == '{' ? "" : ", ") + quoted(name) + numbers;
        }
        out += "}, \"passes_clock\": ";
        out += report.passes_clock == MeterClock::device ? "\"device\"" : "\"processor\"";
        out += ", \"frames_ms\": [";
        for (const double ms : report.frame_ms) {
            std::snprintf(numbers, sizeof numbers, "%s%.3f", out.back() == '[' ? "" : ", ", ms);
            out += numbers;
        }
        out += "]}";
    }
    std::snprintf(numbers, sizeof numbers,
                  ", \"streaming\": {\"needed_bytes\": %llu, \"peak_bytes\": %llu, \"uploads\": %llu, "
                  "\"uploaded_bytes\": %llu, \"evictions\": %llu, \"worst_error\": %.3f, \"open_ms\": %.3f, "
                  "\"first_frame_s\": %.4f, \"read_mb_s\": %.1f",
                  static_cast<unsigned long long>(report.streaming.needed_bytes),
                  static_cast<unsigned long long>(report.streaming.peak_bytes),
                  static_cast<unsigned long long>(report.streaming.uploads),
                  static_cast<unsigned long long>(report.streaming.uploaded_bytes),
                  static_cast<unsigned long long>(report.streaming.evictions),
                  static_cast<double>(report.streaming.worst_error), report.streaming.open_ms,
                  report.moments.empty() ? 0.0 : report.moments.front().s,
                  report.streaming.read_bytes_per_s / 1e6);
    out += numbers;
    out += ", \"frames\": [";
    for (const StreamingMoment &moment : report.moments) {
        std::snprintf(numbers, sizeof numbers, "%s[%.4f, %.3f, %.3f, %llu]", out.back() == '[' ? "" : ", ",
                      moment.s, static_cast<double>(moment.worst_error), moment.stream_ms,
                      static_cast<unsigned long long>(moment.uploaded_bytes));
        out += numbers;
    }
    out += "]}";
    std::vector<std::string> features;
    for (const QualityFeature feature : report.features) {
        features.emplace_back(feature_names[static_cast<std::size_t>(feature)]);
    }
    out += ", \"quality\": " + quoted(report.quality) + ", \"features\": " + quoted(features);
    if (report.reference) {
        out += ", \"reference\": " + std::to_string(*report.reference);
    }
    if (report.fps) {
        out += ", \"fps\": " + fps_json(*report.fps, report.features);
    }
    if (report.terrain) {
        const TerrainCounts &terrain = *report.terrain;
        out += ", \"terrain\": {\"patches\": " + std::to_string(terrain.patches) +
               ", \"triangles\": " + std::to_string(terrain.triangles) +
               ", \"cut_patches\": " + std::to_string(terrain.cut_patches) +
               ", \"cut_triangles\": " + std::to_string(terrain.cut_triangles) +
               ", \"arrived\": " + std::to_string(terrain.resident_patches) +
               ", \"baked\": " + std::to_string(terrain.total_patches) +
               ", \"bytes\": " + std::to_string(report.streaming.terrain_bytes) + "}";
    }
    out += ", \"draw_calls\": " + std::to_string(report.draw_calls) +
           ", \"most_draw_calls\": " + std::to_string(report.most_draw_calls) +
           ", \"program_bytes\": " + std::to_string(program_bytes()) +
           ", \"shared_libraries\": " + quoted(shared_libraries()) +
           ", \"gl_renderer\": " + quoted(report.renderer) + ", \"gl_version\": " + quoted(report.version) +
           ", \"screenshots\": " + quoted(report.screenshots) +
           ", \"beyond\": " + quoted(report.exceeded_limits);
    return out + "}";
}

} // namespace paradize
