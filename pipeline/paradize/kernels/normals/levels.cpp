#include "normals/levels.hpp"

#include <algorithm>
#include <array>

#include "math/functions.hpp"
#include "normals/sweep.hpp"

namespace paradize::normals {
namespace {

constexpr std::array<float, 3> weights = {0.2126F, 0.7152F, 0.0722F};

} // namespace

Luminance::Luminance(const ColorView &color, bool encoded, bool widest)
    : color_(color), encoded_(encoded), lookup_(widest && color.bytes != nullptr && has_byte_lookup()) {
    const auto light = [&](std::size_t code, double top) {
        const double share = static_cast<double>(code) / top;
        return static_cast<float>(encoded ? mathx::srgb_to_linear(share) : share);
    };
    for (std::size_t code = 0; code < 256 && color.bytes != nullptr; ++code) {
        for (std::size_t c = 0; c < 3; ++c) {
            shares_[c][code] = weights[c] * light(code, 255.0);
        }
    }
    planes_ = planes_of(shares_);
    if (color.words != nullptr) {
        table_.resize(65536);
        for (std::size_t code = 0; code < table_.size(); ++code) {
            table_[code] = light(code, 65535.0);
        }
    }
}

void Luminance::row(std::size_t y, float *to) const {
    const std::size_t channels = color_.channels;
    const std::size_t begin = y * color_.columns * channels;
    const std::size_t end = begin + color_.columns * channels;
    if (color_.bytes != nullptr) {
        const float *red = shares_[0].data();
        const float *green = shares_[1].data();
        const float *blue = shares_[2].data();
        const std::uint8_t *v = color_.bytes + begin;
        if (lookup_) {
            const std::size_t done = light_of_bytes(v, color_.columns, channels, planes_, to);
            v += done * channels;
            to += done;
        }
        for (; v != color_.bytes + end; v += channels) {
            *to++ = red[v[0]] + green[v[1]] + blue[v[2]];
        }
        return;
    }
    if (color_.words != nullptr) {
        for (const std::uint16_t *v = color_.words + begin; v != color_.words + end; v += channels) {
            *to++ = weights[0] * table_[v[0]] + weights[1] * table_[v[1]] + weights[2] * table_[v[2]];
        }
        return;
    }
    float *first = to;
    for (const float *v = color_.floats + begin; v != color_.floats + end; v += channels) {
        std::array<float, 3> light = {v[0], v[1], v[2]};
        for (float &part : light) {
            part = encoded_ ? static_cast<float>(mathx::srgb_to_linear(part)) : part;
        }
        *to++ = weights[0] * light[0] + weights[1] * light[1] + weights[2] * light[2];
    }
    if (!all_finite(first, color_.columns)) {
        throw NotFinite{};
    }
}

bool Luminance::exact_unit() const {
    // (t - 1/2) + 1/2 in double is t again where t, a float, is zero or at least 2^-31: codes' are.
    return color_.bytes != nullptr && shares_[0][255] + shares_[1][255] + shares_[2][255] <= 1.0F;
}

LevelRow::LevelRow(const maps::Levels &levels, const Luminance &luminance, const Kernels &kernels)
    : levels_(levels),
      neutral_(luminance.exact_unit() && levels.black == 0.0 && levels.white == 1.0 && levels.gamma == 1.0 &&
               levels.contrast == 1.0 && levels.brightness == 0.0 && !levels.invert),
      kernels_(kernels) {}

void LevelRow::apply(const float *from, std::size_t n, float *to) const {
    if (neutral_) {
        std::copy_n(from, n, to);
        return;
    }
    if (levels_.gamma == 1.0) {
        const double range = levels_.white - levels_.black;
        kernels_.levels(from, n, {levels_.black, range, levels_.contrast, levels_.brightness, levels_.invert},
                        to);
        return;
    }
    const maps::LevelCurve curve(levels_);
    std::transform(from, from + n, to, curve);
}

} // namespace paradize::normals
