#include "app/calibration.hpp"

#include "app/messages.hpp"
#include "number_text.hpp"
#include "passes/pass_meter.hpp"
#include "scene/flight.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <limits>

namespace paradize {

namespace {

constexpr int max_positions = 3; // the current second of the flight, then others spread evenly over it
constexpr int max_timed_frames =
    2; // timed frames per position; the fastest counts. An untimed frame comes first.
constexpr double max_calibration_s = 4.0; // time limit of the calibration, estimated from one balanced frame
// Estimated cost of a frame against a balanced one: slower tiers, and the first frame after a change.
constexpr double cost_margin = 2.0;

// Mean FLIP against --reference 16 by feature and tier, other features balanced. Measured on the island at
// seconds 75 and 113, 320 x 180, llvmpipe. Parallax differed by 3e-5 only, and anisotropy is off on llvmpipe:
// for these two only the order of the tiers is meaningful.
constexpr std::array<std::array<double, tier_names.size()>, feature_count> shipped_errors{{
    {0.12199, 0.04313, 0.04236}, // shadow
    {0.04757, 0.04313, 0.04140}, // reflection
    {0.04396, 0.04313, 0.04272}, // refraction
    {0.04314, 0.04313, 0.04312}, // parallax
    {0.04314, 0.04313, 0.04312}, // anisotropy
    {0.04365, 0.04313, 0.04286}, // lod
    {0.06318, 0.04313, 0.04313}, // resolution
}};

double drawn_ms(Renderer &renderer, double elapsed_s, const Pose &pose) {
    const double start = now_ms();
    renderer.draw(elapsed_s, pose);
    glFinish();
    return now_ms() - start;
}

/// How many frames are timed for each quality.
struct SamplePlan {
    int positions = 1;
    int frames = 1;
};

/// Chooses the largest plan within `max_calibration_s`. More frames come before more positions, because noise
/// misleads more.
SamplePlan plan_samples(double balanced_ms, std::size_t qualities) {
    const auto cost_s = [&](const SamplePlan &plan) {
        const int frames = plan.positions * (1 + plan.frames);
        return 1e-3 * cost_margin * balanced_ms * frames * static_cast<double>(qualities);
    };
    SamplePlan out;
    for (const SamplePlan &more : {SamplePlan{1, max_timed_frames}, SamplePlan{2, max_timed_frames},
                                   SamplePlan{max_positions, max_timed_frames}}) {
        out = cost_s(more) <= max_calibration_s ? more : out;
    }
    return out;
}

/// Returns the milliseconds of a frame, as the mean over the positions.
double frame_ms(Renderer &renderer, const assets::Flight &flight, double elapsed_s, const SamplePlan &plan) {
    double sum = 0.0;
    for (int position = 0; position < plan.positions; ++position) {
        const Pose pose = flight_pose(flight, elapsed_s + flight.duration_s * position / plan.positions);
        double least = std::numeric_limits<double>::max();
        drawn_ms(renderer, elapsed_s, pose);
        for (int i = 0; i < plan.frames; ++i) {
            least = std::min(least, drawn_ms(renderer, elapsed_s, pose));
        }
        sum += least;
    }
    return sum / plan.positions;
}

std::size_t index_of(std::span<const std::string_view> names, const std::string &name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

} // namespace

Calibration calibrate(Renderer &renderer, const assets::SceneFile &file,
                      std::span<const QualityFeature> features, const Device &device, double elapsed_s,
                      std::span<const assets::FeatureError> errors) {
    const double start = now_ms();
    renderer.change_settings(render_settings(file, all_at(Tier::balanced), device));
    const Pose here = flight_pose(file.flight, elapsed_s);
    drawn_ms(renderer, elapsed_s, here); // untimed: drivers compile shaders at the first draw
    const std::size_t qualities = 2 + 2 * features.size();
    const SamplePlan plan = plan_samples(drawn_ms(renderer, elapsed_s, here), qualities);
    const auto several = [](int count, const std::string &noun) {
        return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
    };
    log_message("--fps: measuring " + std::to_string(qualities) + " qualities, " +
                several(plan.frames, "frame") + " of each from " + several(plan.positions, "place") +
                " of the flight");
    const auto measured = [&](const Quality &quality) {
        renderer.change_settings(render_settings(file, quality, device));
        return frame_ms(renderer, file.flight, elapsed_s, plan);
    };
    constexpr auto balanced = static_cast<std::size_t>(Tier::balanced);
    constexpr auto exact = static_cast<std::size_t>(Tier::exact);
    Calibration out;
    Quality fastest = all_at(Tier::balanced);
    for (const QualityFeature feature : features) {
        fastest[static_cast<std::size_t>(feature)] = Tier::fast;
    }
    out.base_ms = measured(fastest);
    const double balanced_ms = measured(all_at(Tier::balanced));
    out.base_ms = std::min(out.base_ms, balanced_ms); // a lower tier that measures slower is noise
    for (const QualityFeature feature : features) {
        const auto t = static_cast<std::size_t>(feature);
        Quality quality = all_at(Tier::balanced);
        quality[t] = Tier::fast;
        const double fast_ms = measured(quality);
        quality[t] = Tier::exact;
        // A higher tier that measures faster is noise.
        out.table[t][balanced].ms = std::max(balanced_ms - fast_ms, 0.0);
        out.table[t][exact].ms = std::max(measured(quality) - fast_ms, out.table[t][balanced].ms);
        for (std::size_t tier = 0; tier < tier_names.size(); ++tier) {
            out.table[t][tier].error = shipped_errors[t][tier];
        }
    }
    for (const assets::FeatureError &error : errors) {
        const std::size_t t = index_of(feature_names, error.feature);
        const std::size_t tier = index_of(tier_names, error.tier);
        if (t < feature_count && tier < tier_names.size()) {
            out.table[t][tier].error = error.flip;
        }
    }
    log_message("--fps: measured in " + fixed(1e-3 * (now_ms() - start), 1) + " s");
    return out;
}

} // namespace paradize
