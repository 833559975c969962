#include "reference/maps/tally.hpp"

#include <algorithm>
#include <array>
#include <functional>

#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t lanes = 16;

PARADIZE_CLONES bool any_above(const double *values, double least) {
    int found = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
        found |= values[i] > least ? 1 : 0;
    }
    return found != 0;
}

PARADIZE_CLONES void add_lanes(const double *values, std::size_t count, double *sums) {
    for (std::size_t i = 0; i < count; i += lanes) {
        for (std::size_t k = 0; k < lanes; ++k) {
            sums[k] += values[i + k];
        }
    }
}

} // namespace

std::size_t above_p99(std::size_t n) {
    if (n == 0) {
        return 0;
    }
    const std::size_t rank = std::min(n - 1, (n * 99 + 99) / 100 - 1);
    return n - rank;
}

void Largest::add(std::span<const double> values) {
    const auto take = [&](double value) {
        if (value > least_) {
            held_.push_back(value);
            if (held_.size() >= 2 * keep_) {
                prune();
            }
        }
    };
    std::size_t i = 0;
    for (; i + lanes <= values.size(); i += lanes) {
        if (any_above(&values[i], least_)) {
            for (std::size_t k = 0; k < lanes; ++k) {
                take(values[i + k]);
            }
        }
    }
    for (; i < values.size(); ++i) {
        take(values[i]);
    }
}

void Largest::prune() {
    if (held_.size() <= keep_) {
        return;
    }
    const auto nth = held_.begin() + static_cast<std::ptrdiff_t>(keep_ - 1);
    std::nth_element(held_.begin(), nth, held_.end(), std::greater<>());
    least_ = *nth; // others as large as it add nothing that is not held already
    held_.resize(keep_);
}

double Largest::kth(std::size_t k) {
    const auto nth = held_.begin() + static_cast<std::ptrdiff_t>(k - 1);
    std::nth_element(held_.begin(), nth, held_.end(), std::greater<>());
    return *nth;
}

double ordered_sum(std::span<const double> values) {
    std::array<double, lanes> sums{};
    const std::size_t whole = values.size() / lanes * lanes;
    add_lanes(values.data(), whole, sums.data());
    for (std::size_t i = whole; i < values.size(); ++i) {
        sums[i - whole] += values[i];
    }
    for (std::size_t half = lanes / 2; half > 0; half /= 2) {
        for (std::size_t k = 0; k < half; ++k) {
            sums[k] += sums[k + half];
        }
    }
    return sums[0];
}

} // namespace paradize::reference
