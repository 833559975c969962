#include "scene/random.hpp"

namespace paradize {

std::uint32_t Pcg::next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
}

float Pcg::uniform(float low, float high) {
    const float unit = static_cast<float>(next() >> 8U) * (1.0F / 16777216.0F);
    return low + (high - low) * unit;
}

} // namespace paradize
