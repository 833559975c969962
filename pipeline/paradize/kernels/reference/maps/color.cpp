#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "reference/maps/comparers.hpp"
#include "reference/maps/curve.hpp"
#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

// Pixels row by row. What integers stand for is looked up: there are few of them.
class PixelRows {
  public:
    PixelRows(const Pixels &pixels, std::size_t columns) : pixels_(pixels), columns_(columns) {
        if (pixels.kind == Pixels::Kind::f32) {
            return;
        }
        const std::size_t codes = pixels.kind == Pixels::Kind::u8 ? 256 : 65536;
        plain_.resize(codes);
        for (std::size_t code = 0; code < codes; ++code) {
            plain_[code] = static_cast<double>(code) / static_cast<double>(codes - 1);
        }
        light_ = plain_;
        if (pixels.encoded) {
            decode_srgb(plain_.data(), codes, light_.data());
        }
    }

    std::size_t channels() const { return pixels_.channels; }
    bool encoded() const { return pixels_.encoded; }

    // Channel c of row y as it is stored, 0..1.
    void stored(std::size_t y, std::size_t c, double *out) const { read(y, c, plain_, out); }
    // The same as linear light.
    void light(std::size_t y, std::size_t c, double *out) const {
        read(y, c, light_, out);
        if (pixels_.encoded && light_.empty()) {
            decode_srgb(out, columns_, out);
        }
    }

  private:
    void read(std::size_t y, std::size_t c, const std::vector<double> &table, double *out) const {
        const std::size_t n = pixels_.channels;
        const std::size_t first = y * columns_ * n + c;
        switch (pixels_.kind) {
        case Pixels::Kind::u8:
            look_up(static_cast<const std::uint8_t *>(pixels_.data) + first, table, out);
            break;
        case Pixels::Kind::u16:
            look_up(static_cast<const std::uint16_t *>(pixels_.data) + first, table, out);
            break;
        case Pixels::Kind::f32: {
            const float *from = static_cast<const float *>(pixels_.data) + first;
            for (std::size_t x = 0; x < columns_; ++x) {
                out[x] = std::clamp<double>(from[x * n], 0.0, 1.0);
            }
        }
        }
    }
    template <typename Code>
    void look_up(const Code *from, const std::vector<double> &table, double *out) const {
        for (std::size_t x = 0; x < columns_; ++x) {
            out[x] = table[from[x * pixels_.channels]];
        }
    }

    Pixels pixels_;
    std::size_t columns_;
    std::vector<double> plain_; // code -> value; empty for floats
    std::vector<double> light_; // code -> linear light
};

PARADIZE_CLONES void multiply(const double *__restrict a, const double *__restrict b, std::size_t count,
                              double *__restrict out) {
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = a[i] * b[i];
    }
}

// out = over / under where there is any of `under`, else `other`.
PARADIZE_CLONES void divide(const double *__restrict over, const double *__restrict under,
                            const double *__restrict other, std::size_t count, double *__restrict out) {
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = under[i] > 0.0 ? over[i] / under[i] : other[i];
    }
}

// Planes of linear light; where there is alpha, then those of light times alpha, and alpha.
class ColorRows final : public Rows {
  public:
    ColorRows(const PixelRows &pixels, std::size_t columns) : pixels_(pixels), columns_(columns) {}
    std::size_t channels() const override { return pixels_.channels() == 4 ? 7 : 3; }
    std::unique_ptr<Rows> fresh() const override { return std::make_unique<ColorRows>(*this); }
    void row(std::size_t y, double *out) override {
        for (std::size_t c = 0; c < 3; ++c) {
            pixels_.light(y, c, out + c * columns_);
        }
        if (pixels_.channels() == 4) {
            double *alpha = out + 6 * columns_;
            pixels_.stored(y, 3, alpha);
            for (std::size_t c = 0; c < 3; ++c) {
                multiply(out + c * columns_, alpha, columns_, out + (3 + c) * columns_);
            }
        }
    }

  private:
    const PixelRows &pixels_;
    std::size_t columns_;
};

using Planes = std::vector<std::vector<double>>; // the averaged alpha of each level but the first

class ColorComparer final : public MapComparer {
  public:
    // alphas: where to keep averaged alpha until a whole level is known; empty where there is no cutoff.
    ColorComparer(const TextureView &texture, const PixelRows &pixels, Planes &alphas, RowSums &sums)
        : MapComparer(texture, 3, sums), pixels_(pixels), alphas_(alphas), truth_(3 * texture.size.columns),
          found_(3 * texture.size.columns), errors_(found_.size()), squares_(found_.size()) {}

    void row(std::size_t level, std::size_t y, const double *light) override {
        const std::size_t count = columns(level);
        const double *alpha = light + 6 * count;
        if (level == 0 && pixels_.encoded()) {
            for (std::size_t c = 0; c < 3; ++c) {
                pixels_.stored(y, c, &truth_[c * count]);
            }
        } else if (pixels_.channels() == 4) {
            for (std::size_t c = 0; c < 3; ++c) {
                divide(light + (3 + c) * count, alpha, light + c * count, count, &found_[c * count]);
            }
            encode_srgb(found_.data(), 3 * count, truth_.data());
        } else {
            encode_srgb(light, 3 * count, truth_.data());
        }
        for (std::size_t c = 0; c < 3; ++c) {
            decoded(level, y, c, &found_[c * count]);
        }
        if (level > 0 && pixels_.channels() == 4) {
            forgive_unseen(alpha, count);
        }
        const double sum =
            differences(truth_.data(), found_.data(), 3 * count, errors_.data(), squares_.data());
        take(level, y, {errors_.data(), 3 * count}, sum);
        if (pixels_.channels() != 4) {
            return;
        }
        if (level > 0 && !alphas_.empty()) {
            std::copy_n(alpha, count, alphas_[level].begin() + static_cast<std::ptrdiff_t>(y * count));
        } else {
            compare_alpha(level, y, alpha);
        }
    }

    void compare_alpha(std::size_t level, std::size_t y, const double *alpha) {
        const std::size_t count = columns(level);
        decoded(level, y, 3, found_.data());
        sums_.levels[level].alpha_squares[y] =
            differences(alpha, found_.data(), count, errors_.data(), squares_.data());
    }

  private:
    // A texel that is wholly transparent in a level's mean may have any colour.
    void forgive_unseen(const double *alpha, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            if (alpha[i] <= 0.0) {
                for (std::size_t c = 0; c < 3; ++c) {
                    truth_[c * count + i] = found_[c * count + i];
                }
            }
        }
    }

    const PixelRows &pixels_;
    Planes &alphas_;
    std::vector<double> truth_;
    std::vector<double> found_;
    std::vector<double> errors_;
    std::vector<double> squares_;
};

// The share of level 0's texels whose alpha is at or above the cutoff, compared as float32.
double share_of(const Pixels &pixels, Size size, double cutoff) {
    const auto least = static_cast<float>(cutoff);
    const std::size_t count = size.rows * size.columns;
    const auto counted = [&](const auto *data, float top) {
        std::size_t passed = 0;
        for (std::size_t i = 0; i < count; ++i) {
            passed += static_cast<float>(data[4 * i + 3]) / top >= least ? 1 : 0;
        }
        return static_cast<double>(passed) / static_cast<double>(count);
    };
    switch (pixels.kind) {
    case Pixels::Kind::u8:
        return counted(static_cast<const std::uint8_t *>(pixels.data), 255.0F);
    case Pixels::Kind::u16:
        return counted(static_cast<const std::uint16_t *>(pixels.data), 65535.0F);
    default:
        return counted(static_cast<const float *>(pixels.data), 1.0F);
    }
}

// The factor that lets `share` of a level's texels reach the cutoff.
double factor_of(const std::vector<double> &alpha, double share, double cutoff) {
    const auto wanted = static_cast<std::size_t>(std::floor(share * static_cast<double>(alpha.size()) + 0.5));
    if (wanted == 0) {
        return 1.0;
    }
    std::vector<double> sorted = alpha;
    const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(wanted - 1);
    std::nth_element(sorted.begin(), nth, sorted.end(), std::greater<>());
    return *nth > 0.0 ? std::clamp(cutoff / *nth, 1.0 / 16.0, 16.0) : 1.0;
}

} // namespace

std::vector<LevelError> color_levels(const TextureView &texture, const Pixels &pixels, double cutoff,
                                     int threads) {
    const bool alpha = pixels.channels == 4;
    Planes alphas;
    if (alpha && cutoff > 0.0) {
        alphas.resize(texture.levels.size());
        for (std::size_t k = 1; k < alphas.size(); ++k) {
            const Size size = level_size(texture.size, k);
            alphas[k].resize(size.rows * size.columns);
        }
    }
    const PixelRows source(pixels, texture.size.columns);
    const ColorRows truth(source, texture.size.columns);
    RowSums sums(texture);
    std::vector<std::unique_ptr<Comparer>> comparers;
    for (int k = 0; k < std::max(1, threads); ++k) {
        comparers.push_back(std::make_unique<ColorComparer>(texture, source, alphas, sums));
    }
    feed_levels(texture.size, texture.levels.size(), truth, comparers);
    const double share = alphas.empty() ? 0.0 : share_of(pixels, texture.size, cutoff);
    auto &comparer = static_cast<ColorComparer &>(*comparers[0]);
    for (std::size_t k = 1; k < alphas.size(); ++k) {
        const Size size = level_size(texture.size, k);
        const double factor = factor_of(alphas[k], share, cutoff);
        for (double &value : alphas[k]) {
            value = std::min(1.0, value * factor);
        }
        for (std::size_t y = 0; y < size.rows; ++y) {
            comparer.compare_alpha(k, y, &alphas[k][y * size.columns]);
        }
    }
    std::vector<LevelError> out = MapComparer::results(comparers, sums);
    for (std::size_t k = 0; alpha && k < out.size(); ++k) {
        const Size size = level_size(texture.size, k);
        out[k].alpha_count = size.rows * size.columns;
    }
    return out;
}

} // namespace paradize::reference
