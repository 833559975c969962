#include "reference/maps/angle.hpp"

#include <cmath>

#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

constexpr double pi = 0x1.921fb54442d18p+1;

} // namespace

PARADIZE_CLONES void rebuild(const double *x, const double *y, std::size_t count, Directions out) {
    for (std::size_t i = 0; i < count; ++i) {
        const double flat = x[i] * x[i] + y[i] * y[i];
        const double square = 1.0 - flat > 0.0 ? 1.0 - flat : 0.0;
        const double length = std::sqrt(flat + square);
        out.x[i] = x[i] / length;
        out.y[i] = y[i] / length;
        out.z[i] = std::sqrt(square) / length;
    }
}

PARADIZE_CLONES void normalise(const double *x, const double *y, const double *z, std::size_t count,
                               Directions out) {
    for (std::size_t i = 0; i < count; ++i) {
        const double length = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
        const bool known = length > 1e-7;
        const double inverse = 1.0 / (known ? length : 1.0);
        out.x[i] = known ? x[i] * inverse : 0.0;
        out.y[i] = known ? y[i] * inverse : 0.0;
        out.z[i] = known ? z[i] * inverse : 1.0;
    }
}

PARADIZE_CLONES void angles_between(Directions a, Directions b, std::size_t count, double *degrees) {
    for (std::size_t i = 0; i < count; ++i) {
        const double mx = a.x[i] - b.x[i];
        const double my = a.y[i] - b.y[i];
        const double mz = a.z[i] - b.z[i];
        const double px = a.x[i] + b.x[i];
        const double py = a.y[i] + b.y[i];
        const double pz = a.z[i] + b.z[i];
        const double apart = mx * mx + my * my + mz * mz;
        const double together = px * px + py * py + pz * pz;
        const bool obtuse = apart > together;
        const double less = obtuse ? together : apart;
        const double more = obtuse ? apart : together; // never 0: the two add up to 4
        // The arc tangent of t <= 1: the angle halved twice leaves t <= 0.199, whose series ends soon.
        double t = std::sqrt(less / more);
        t = t / (1.0 + std::sqrt(1.0 + t * t));
        t = t / (1.0 + std::sqrt(1.0 + t * t));
        const double s = t * t;
        double sum = 1.0 / 23.0;
        sum = 1.0 / 21.0 - s * sum;
        sum = 1.0 / 19.0 - s * sum;
        sum = 1.0 / 17.0 - s * sum;
        sum = 1.0 / 15.0 - s * sum;
        sum = 1.0 / 13.0 - s * sum;
        sum = 1.0 / 11.0 - s * sum;
        sum = 1.0 / 9.0 - s * sum;
        sum = 1.0 / 7.0 - s * sum;
        sum = 1.0 / 5.0 - s * sum;
        sum = 1.0 / 3.0 - s * sum;
        const double angle = 8.0 * (t - t * s * sum);
        degrees[i] = (obtuse ? pi - angle : angle) * (180.0 / pi);
    }
}

} // namespace paradize::reference
