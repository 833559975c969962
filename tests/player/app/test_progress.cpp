// How far a run without a window says that it is.

#include "app/progress.hpp"

#include <doctest/doctest.h>

#include <cstddef>
#include <optional>
#include <vector>

using namespace paradize;

TEST_CASE("progress: a run says every five seconds how long the rest takes, if it goes on so") {
    Progress progress(300, 1000.0);
    std::vector<double> said_s, left_s;
    for (int frame = 1; frame <= 300; ++frame) {
        const double now_ms = 1000.0 + 400.0 * frame; // two minutes in all
        if (const std::optional<double> left = progress.drawn(now_ms)) {
            said_s.push_back((now_ms - 1000.0) / 1000.0);
            left_s.push_back(*left);
        }
    }
    CHECK(progress.count() == 300);
    REQUIRE(said_s.size() == 23);
    double before_s = 0.0;
    for (std::size_t i = 0; i < said_s.size(); ++i) {
        CHECK(said_s[i] - before_s == doctest::Approx(5.2)); // the first frame that ends after five seconds
        CHECK(left_s[i] == doctest::Approx(120.0 - said_s[i]));
        before_s = said_s[i];
    }
}

TEST_CASE("progress: a run of less than five seconds says nothing, nor does the last frame of a longer one") {
    Progress quick(300, 0.0);
    for (int frame = 1; frame <= 300; ++frame) {
        CHECK_FALSE(quick.drawn(16.0 * frame));
    }
    Progress slow(2, 0.0);
    CHECK(slow.drawn(60000.0) == 60.0);
    CHECK_FALSE(slow.drawn(120000.0));
}
