#include "app/rate_control.hpp"

#include "app/messages.hpp"
#include "assets/file_bytes.hpp"
#include "assets/json_reader.hpp"
#include "assets/tradeoff_file.hpp"
#include "number_text.hpp"

namespace paradize {

namespace {

constexpr std::size_t max_recent_frames = 4096; // frame times that are kept

/// Loads the errors of the quality features for this scene, which `paradize measure` may have written beside
/// the folder: island.tradeoff.json beside island/. Returns an empty list if there is no such file.
std::vector<assets::FeatureError> load_tradeoff(const std::filesystem::path &folder) {
    std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
    path = path.has_filename() ? path : path.parent_path();
    path += ".tradeoff.json";
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) {
        return {};
    }
    const assets::FileBytes file(path, {.max = assets::max_json_bytes});
    const auto bytes = file.bytes();
    return assets::parse_tradeoff({reinterpret_cast<const char *>(bytes.data()), bytes.size()}, path);
}

} // namespace

RateControl::RateControl(double fps, Renderer &renderer, const assets::SceneFile &file,
                         std::span<const QualityFeature> features, const Device &device, double elapsed_s,
                         const std::filesystem::path &folder)
    : fps_(fps), calibration_(calibrate(renderer, file, features, device, elapsed_s, load_tradeoff(folder))),
      governor_(pareto_front(calibration_.table, features, calibration_.base_ms), 1000.0 / fps) {
    recent_ms_.reserve(max_recent_frames);
    const std::string wanted = "--fps " + shortest(fps) + ": ";
    const std::string expected = fixed(governor_.current().ms, 3) + " ms";
    log_message(wanted + to_text(quality()) + "; expected " + expected + " per frame");
    if (governor_.out_of_reach()) {
        log_message(wanted + "the budget is " + fixed(governor_.budget_ms(), 3) +
                    " ms per frame, the fastest quality needs " + expected + "; use a smaller --size");
    }
}

bool RateControl::observe(double ms) {
    recent_ms_.push_back(ms);
    const bool changes = governor_.observe(ms);
    if (changes) {
        recent_ms_.clear();
    }
    if (recent_ms_.size() == max_recent_frames) {
        recent_ms_.erase(recent_ms_.begin(), recent_ms_.begin() + max_recent_frames / 2);
    }
    return changes;
}

FrameRate RateControl::report(const std::vector<double> &frame_ms) const {
    return {fps_,
            quality(),
            governor_.current().ms,
            median(recent_ms_.empty() ? frame_ms : recent_ms_),
            governor_.changes(),
            calibration_.table};
}

} // namespace paradize
