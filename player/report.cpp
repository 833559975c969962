#include "report.hpp"

#include <algorithm>
#include <cstdio>
#include <sys/resource.h>

namespace paradize {

namespace {

std::string quoted(const std::string &text) {
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

} // namespace

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

std::string to_json(const Report &report) {
    char numbers[512];
    std::snprintf(
        numbers, sizeof numbers,
        "{\"frames\": %zu, \"width\": %d, \"height\": %d, \"frame_ms\": %.3f, \"resident_bytes\": %llu, "
        "\"total_bytes\": %llu, \"peak_rss_bytes\": %llu",
        report.frame_ms.size(), report.width_px, report.height_px, median(report.frame_ms),
        static_cast<unsigned long long>(report.resident_bytes),
        static_cast<unsigned long long>(report.total_bytes),
        static_cast<unsigned long long>(peak_rss_bytes()));
    std::string out = numbers;
    out += ", \"gl_renderer\": " + quoted(report.renderer) + ", \"gl_version\": " + quoted(report.version) +
           ", \"screenshots\": [";
    for (std::size_t i = 0; i < report.screenshots.size(); ++i) {
        out += (i == 0 ? "" : ", ") + quoted(report.screenshots[i]);
    }
    return out + "]}";
}

} // namespace paradize
