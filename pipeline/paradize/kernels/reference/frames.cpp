#include "reference/frames.hpp"

#include <cmath>
#include <cstddef>

#include "math/functions.hpp"

namespace paradize::reference {

void angles_deg(std::span<const float> a, std::span<const float> b, std::span<double> out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double ax = a[i * 3], ay = a[i * 3 + 1], az = a[i * 3 + 2];
        const double bx = b[i * 3], by = b[i * 3 + 1], bz = b[i * 3 + 2];
        const double cx = ay * bz - az * by, cy = az * bx - ax * bz, cz = ax * by - ay * bx;
        const double sine = std::sqrt(cx * cx + cy * cy + cz * cz), cosine = ax * bx + ay * by + az * bz;
        const bool known = sine > 0 || cosine != 0;
        out[i] = known ? mathx::atan2(sine, cosine) * (180 / mathx::pi) : 90;
    }
}

} // namespace paradize::reference
