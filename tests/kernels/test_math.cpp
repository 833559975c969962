// Elementary functions: known values, and that the compiler's constants are what the machine computes.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "math/functions.hpp"

using namespace paradize;

TEST_CASE("elementary functions keep their identities") {
    for (int i = -200; i <= 200; ++i) {
        const double x = i * 0.0371;
        CHECK(mathx::exp(x) * mathx::exp(-x) == doctest::Approx(1.0).epsilon(1e-15));
        CHECK(mathx::sin(x) * mathx::sin(x) + mathx::cos(x) * mathx::cos(x) ==
              doctest::Approx(1.0).epsilon(1e-15));
        CHECK(mathx::sin(-x) == -mathx::sin(x));
        CHECK(mathx::log(mathx::exp(x)) == doctest::Approx(x).epsilon(1e-14));
        CHECK(mathx::cos(mathx::acos(x / 8.0)) == doctest::Approx(x / 8.0).epsilon(1e-14));
        CHECK(mathx::atan2(mathx::sin(x / 4.0), mathx::cos(x / 4.0)) ==
              doctest::Approx(x / 4.0).epsilon(1e-14));
    }
}

TEST_CASE("elementary functions agree with the C library to a few units in the last place") {
    for (int i = 1; i <= 500; ++i) {
        const double x = i * 0.013;
        CHECK(mathx::exp(x) == doctest::Approx(std::exp(x)).epsilon(1e-15));
        CHECK(mathx::log(x) == doctest::Approx(std::log(x)).epsilon(1e-15));
        CHECK(mathx::pow(x, 2.4) == doctest::Approx(std::pow(x, 2.4)).epsilon(4e-15));
        CHECK(std::abs(mathx::sin(x * 100.0) - std::sin(x * 100.0)) < 3e-16);
        CHECK(std::abs(mathx::cos(x * 100.0) - std::cos(x * 100.0)) < 3e-16);
    }
}

TEST_CASE("what is no number stays none, and limits are limits") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(std::isnan(mathx::exp(nan)));
    CHECK(std::isnan(mathx::log(-1.0)));
    CHECK(std::isnan(mathx::sin(std::numeric_limits<double>::infinity())));
    CHECK(std::isnan(mathx::acos(nan)));
    CHECK(mathx::exp(-800.0) == 0.0);
    CHECK(mathx::exp(800.0) == std::numeric_limits<double>::infinity());
    CHECK(mathx::exp(-740.0) > 0.0);
    CHECK(mathx::log(std::numeric_limits<double>::denorm_min()) == doctest::Approx(-744.4400719213812));
    CHECK(mathx::acos(2.0) == 0.0);
    CHECK(mathx::atan2(0.0, -1.0) == mathx::pi);
}

TEST_CASE("the compiler and the machine give the same bits") {
    static_assert(mathx::exp(0.0) == 1.0);
    static_assert(mathx::cos(0.0) == 1.0);
    constexpr double folded = mathx::srgb_to_linear(0.5);
    volatile double half = 0.5;
    CHECK(mathx::srgb_to_linear(half) == folded);
    CHECK(mathx::linear_to_srgb(folded) == doctest::Approx(0.5).epsilon(1e-15));
}
