#include "context.hpp"
#include "files.hpp"
#include "small_scene.hpp"
#include "streaming/demand.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

const Pose towards{{0.0, 1.0, 6.0}, {0.0, 0.0, 0.0}};
const Pose away{{0.0, 1.0, 6.0}, {0.0, 1.0, 20.0}};

CameraForecast forecast_of(const SmallScene &scene, const Pose &now) {
    return {.settings = render_settings(scene.file, all_at(Tier::balanced), Device()),
            .width_px = 160,
            .height_px = 90,
            .now = now,
            .soon = {away, away, away, away}};
}

} // namespace

TEST_CASE("demand: where files are read slowly it looks further ahead, up to four times as far") {
    CHECK(horizons_for(0.0) == near_horizons_s);
    CHECK(horizons_for(2e9) == near_horizons_s);
    CHECK(horizons_for(5e7) == Horizons{2.0, 4.0, 8.0, 16.0});
    CHECK(horizons_for(1e5) == Horizons{4.0, 8.0, 16.0, 32.0});
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset();
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    Demand demand(scene, streamer);
    CameraForecast forecast = forecast_of(small, away);
    forecast.soon.back() = towards;
    forecast.horizons_s = horizons_for(1e5);
    demand.update(forecast); // in 32 s
    forecast.soon.fill(away);
    for (forecast.elapsed_s = 1.0; forecast.elapsed_s < 36.0; ++forecast.elapsed_s) {
        demand.update(forecast);
        const bool is_needed = demand.needs()[streamer.pieces_of("quad_mesh").first].soon > 1.0F;
        CHECK((is_needed || forecast.elapsed_s > 32.0));
        CHECK((!is_needed || forecast.elapsed_s < 36.0));
    }
}

TEST_CASE("demand: what a look ahead glimpses is needed until its time has come, and ever more") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset(); // casts one also while it is not seen
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    const std::uint32_t mesh = streamer.pieces_of("quad_mesh").first;
    for (const bool steered : {false, true}) {
        Demand demand(scene, streamer);
        CameraForecast forecast = forecast_of(small, away);
        forecast.soon[1] = towards; // in two seconds
        forecast.steered = steered;
        demand.update(forecast);
        const float first = demand.needs()[mesh].soon;
        float before = first;
        CHECK(demand.needs()[mesh].now == 0.0F);
        REQUIRE(before > 1.0F);
        forecast.soon.fill(away);
        for (int frame = 1; frame < 180; ++frame) {
            forecast.elapsed_s = frame / 30.0;
            demand.update(forecast);
            const float soon = demand.needs()[mesh].soon;
            if (steered) {
                CHECK(soon <= before); // a guess that fades
            } else {
                CHECK((forecast.elapsed_s > 2.0 || soon >= before));
            }
            before = soon;
        }
        CHECK(before <= (steered ? 0.1F * first : 0.0F)); // the guess has faded, or its time has passed
    }
}

TEST_CASE("demand: what is seen after some seconds counts the less the later, by 1 / (1 + s)") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset();
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    const std::uint32_t mesh = streamer.pieces_of("quad_mesh").first;
    CameraForecast forecast = forecast_of(small, towards);
    Demand seen(scene, streamer);
    seen.update(forecast);
    const float error = seen.needs()[mesh].now;
    REQUIRE(error > 2.0F);
    forecast.now = away;
    for (std::size_t i = 0; i < forecast.soon.size(); ++i) {
        forecast.soon.fill(away);
        forecast.soon[i] = towards;
        Demand later(scene, streamer);
        later.update(forecast);
        const double share = 1.0 / (1.0 + near_horizons_s[i]);
        CHECK(later.needs()[mesh].soon ==
              doctest::Approx(1.0 + (static_cast<double>(error) - 1.0) * share).epsilon(1e-4));
    }
}
