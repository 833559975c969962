#pragma once
// Values in 0..1 whose neighbours differ, for tests of maps and normals.

#include <cstddef>
#include <vector>

inline std::vector<float> ramp(std::size_t count) {
    std::vector<float> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = static_cast<float>(i * 37 % 101) / 101.0F;
    }
    return out;
}
