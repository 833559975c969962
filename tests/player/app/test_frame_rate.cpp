// --fps: the choice compared with brute force, and the governor.

#include "app/frame_rate.hpp"
#include "passes/particles_pass.hpp" // Pcg, a portable random generator

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

using namespace paradize;

namespace {

constexpr std::array<QualityFeature, feature_count> all_features{
    QualityFeature::shadow,    QualityFeature::reflection, QualityFeature::refraction,
    QualityFeature::parallax,  QualityFeature::anisotropy, QualityFeature::lod,
    QualityFeature::resolution};

/// Random costs that mostly rise and errors that mostly fall, with ties and features that are not worth their
/// cost.
FeatureCosts random_table(std::uint64_t seed) {
    Pcg random(seed);
    FeatureCosts table{};
    for (auto &row : table) {
        for (std::size_t tier = 1; tier < row.size(); ++tier) {
            row[tier].ms = row[tier - 1].ms + std::floor(static_cast<double>(random.uniform(-1.0F, 5.0F)));
            row[tier].error = std::floor(static_cast<double>(random.uniform(0.0F, 9.0F))) * 0.01;
        }
        row[0].error = 0.05;
    }
    return table;
}

/// Least error of all 2187 qualities within the budget, or infinity if none fits.
double brute_force(const FeatureCosts &table, double base_ms, double budget_ms) {
    double best = std::numeric_limits<double>::infinity();
    for (int code = 0; code < 2187; ++code) {
        double ms = base_ms;
        double error = 0.0;
        int rest = code;
        for (const auto &row : table) {
            const FeatureCost &point = row[static_cast<std::size_t>(rest % 3)];
            rest /= 3;
            ms += point.ms;
            error += point.error;
        }
        best = ms <= budget_ms ? std::min(best, error) : best;
    }
    return best;
}

/// Three steps: 4, 8 and 12 ms.
std::vector<PredictedQuality> ladder() {
    FeatureCosts table{};
    table[0] = {{{0.0, 0.3}, {4.0, 0.2}, {8.0, 0.1}}};
    return pareto_front(table, std::array{QualityFeature::shadow}, 4.0);
}

/// Feeds frames of one length until the governor has decided `windows` times. Returns the number of changes.
int run(FrameGovernor &governor, int windows, double frame_ms) {
    int changes = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(windows) * FrameGovernor::window_frames; ++i) {
        changes += governor.observe(frame_ms) ? 1 : 0;
    }
    return changes;
}

} // namespace

TEST_CASE("fps: the choice is the one that brute force finds") {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const FeatureCosts table = random_table(seed);
        const std::vector<PredictedQuality> front = pareto_front(table, all_features, 5.0);
        for (double budget = 2.0; budget < 40.0; budget += 1.5) {
            const double best = brute_force(table, 5.0, budget);
            const PredictedQuality &chosen = front[choose(front, budget)];
            if (std::isinf(best)) {
                CHECK(chosen.ms > budget); // the fastest quality, which is too slow as well
            } else {
                CHECK(chosen.ms <= budget);
                CHECK(chosen.error == doctest::Approx(best));
            }
        }
    }
}

TEST_CASE("fps: the Pareto front rises in time, falls in error, and its sums are right") {
    const FeatureCosts table = random_table(7);
    const std::vector<PredictedQuality> front = pareto_front(table, all_features, 5.0);
    for (std::size_t i = 0; i < front.size(); ++i) {
        double ms = 5.0;
        for (std::size_t feature = 0; feature < feature_count; ++feature) {
            ms += table[feature][static_cast<std::size_t>(front[i].quality[feature])].ms;
        }
        CHECK(front[i].ms == doctest::Approx(ms));
        if (i > 0) {
            CHECK(front[i].ms > front[i - 1].ms);
            CHECK(front[i].error < front[i - 1].error);
        }
    }
}

TEST_CASE("fps: a feature that the scene does not have stays balanced") {
    const FeatureCosts table = random_table(3);
    for (const PredictedQuality &choice : pareto_front(table, std::array{QualityFeature::lod}, 1.0)) {
        CHECK(choice.quality[0] == Tier::balanced);
    }
    CHECK(pareto_front(table, {}, 1.0).size() == 1);
}

TEST_CASE("fps: a steady time inside the budget changes nothing") {
    FrameGovernor governor(ladder(), 9.0);
    CHECK(governor.current().ms == 8.0);
    CHECK(run(governor, 200, 8.0) == 0);
    CHECK_FALSE(governor.out_of_reach());
}

TEST_CASE("fps: one long frame changes nothing, a slower device does") {
    FrameGovernor governor(ladder(), 9.0);
    CHECK_FALSE(governor.observe(500.0));
    CHECK(run(governor, 1, 8.0) == 0);
    CHECK(run(governor, 2, 16.0) == 1); // twice as slow as predicted: 4 ms takes 8
    CHECK(governor.current().ms == 4.0);
}

TEST_CASE("fps: a budget that even the fastest quality exceeds is reported") {
    FrameGovernor slow(ladder(), 3.0);
    CHECK(slow.out_of_reach());
    FrameGovernor governor(ladder(), 9.0);
    CHECK_FALSE(governor.out_of_reach());
    run(governor, 3, 100.0);
    CHECK(governor.current().ms == 4.0);
    CHECK(governor.out_of_reach());
}

TEST_CASE("fps: spare time is used only after several windows") {
    FrameGovernor governor(ladder(), 9.0);
    CHECK(run(governor, FrameGovernor::first_wait_windows - 1, 4.0) == 0);
    CHECK(run(governor, 1, 4.0) == 1); // twice as fast as predicted: 12 ms takes 6
    CHECK(governor.current().ms == 12.0);
    FrameGovernor close(ladder(), 9.0);
    CHECK(run(close, 100, 5.6) == 0); // 12 ms would take 8.4, which leaves too little
}

TEST_CASE("fps: failing steps up become ever rarer") {
    // The better quality takes much longer than predicted.
    FrameGovernor governor(ladder(), 9.0);
    int early = 0;
    int late = 0;
    for (int window = 0; window < 2000; ++window) {
        const double frame_ms = governor.current().ms > 11.0 ? 20.0 : 4.0;
        (window < 1000 ? early : late) += run(governor, 1, frame_ms);
    }
    CHECK(early > 0);
    CHECK(late <= 4);
    CHECK(early <= 24);
    CHECK(governor.changes() == early + late);
}
