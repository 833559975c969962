#include "gutter_means.hpp"

#include <algorithm>
#include <cmath>

namespace paradize::gutter {
namespace {

// Added to alpha where colours are weighted by it, so that what is wholly transparent still has a colour.
constexpr float least_alpha = 1e-4F;

// The cells of a finer line that cell `i` of `coarse` covers, with the lengths covered, in finer cells.
struct Cover {
    std::size_t first = 0;
    std::size_t count = 0;
    std::array<float, 3> length{};
};

Cover cover(std::size_t i, std::size_t fine, std::size_t coarse) {
    // In units of 1 / coarse of a fine cell all borders are whole numbers.
    const std::size_t begin = i * fine;
    const std::size_t end = begin + fine;
    Cover found;
    found.first = begin / coarse;
    for (std::size_t k = found.first; k * coarse < end; ++k) {
        const std::size_t low = std::max(begin, k * coarse);
        const std::size_t high = std::min(end, (k + 1) * coarse);
        found.length[found.count++] = static_cast<float>(high - low) / static_cast<float>(fine);
    }
    return found;
}

} // namespace

Means::Means(const Chain &chain, Kind kind, const Layout &layout)
    : Means(chain.rows, chain.columns, chain.channels, kind) {
    const std::size_t count = rows_ * columns_;
    first_.resize(count + 1);
    parts_.resize(count);
    whole_.resize(count);
    for (std::size_t t = 0; t < count; ++t) {
        const auto from = static_cast<std::size_t>(layout.source[t]);
        const float *value = chain.texels.data() + from * channels_;
        Part &part = parts_[t];
        part.island = layout.owner[t];
        part.share = 1.0F;
        for (std::size_t c = 0; c < channels_; ++c) {
            part.sum[c] = value[c];
        }
        if (kind == Kind::color && channels_ == 4) {
            part.sum[3] += least_alpha;
            for (std::size_t c = 0; c < 3; ++c) {
                part.sum[c] *= part.sum[3];
            }
        } else if (kind == Kind::normal) {
            part.sum[2] = std::sqrt(std::max(0.0F, 1.0F - value[0] * value[0] - value[1] * value[1]));
        }
        whole_[t] = layout.inside[t];
        first_[t + 1] = static_cast<std::uint32_t>(t + 1);
    }
}

Means Means::halved() const {
    Means next(std::max<std::size_t>(1, rows_ / 2), std::max<std::size_t>(1, columns_ / 2), channels_, kind_);
    next.first_.reserve(next.rows_ * next.columns_ + 1);
    next.first_.push_back(0);
    next.parts_.reserve(parts_.size() / 3);
    next.whole_.reserve(next.rows_ * next.columns_);
    const auto before = [](const Part &a, const Part &b) { return a.island < b.island; };
    std::vector<Part> found;
    for (std::size_t y = 0; y < next.rows_; ++y) {
        const Cover down = cover(y, rows_, next.rows_);
        for (std::size_t x = 0; x < next.columns_; ++x) {
            const Cover across = cover(x, columns_, next.columns_);
            const std::size_t start = next.parts_.size();
            bool whole = true;
            found.clear();
            for (std::size_t j = 0; j < down.count; ++j) {
                for (std::size_t i = 0; i < across.count; ++i) {
                    const std::size_t texel = (down.first + j) * columns_ + across.first + i;
                    const float area = down.length[j] * across.length[i];
                    whole = whole && whole_[texel] != 0;
                    for (Part part : parts(texel)) {
                        part.share *= area;
                        for (float &sum : part.sum) {
                            sum *= area;
                        }
                        found.push_back(part);
                    }
                }
            }
            std::stable_sort(found.begin(), found.end(), before);
            for (const Part &part : found) {
                if (next.parts_.size() == start || next.parts_.back().island != part.island) {
                    next.parts_.push_back(part);
                    continue;
                }
                next.parts_.back().share += part.share;
                for (std::size_t c = 0; c < part.sum.size(); ++c) {
                    next.parts_.back().sum[c] += part.sum[c];
                }
            }
            next.first_.push_back(static_cast<std::uint32_t>(next.parts_.size()));
            next.whole_.push_back(whole && next.parts_.size() == start + 1 ? 1 : 0);
        }
    }
    return next;
}

double Means::own(std::size_t texel, std::int32_t island, const float *value, std::size_t channels,
                  std::array<float, 4> &mean) const {
    const std::span<const Part> all = parts(texel);
    const auto it = std::ranges::lower_bound(all, island, {}, &Part::island);
    if (it == all.end() || it->island != island) {
        return 0.0;
    }
    const Part &part = *it;
    if (whole_[texel] != 0) {
        std::copy_n(value, channels, mean.begin());
        return 1.0;
    }
    float divisor = part.share;
    if (kind_ == Kind::color && channels == 4) {
        mean[3] = part.sum[3] / part.share - least_alpha;
        divisor = part.sum[3];
    } else if (kind_ == Kind::normal) {
        divisor =
            std::sqrt(part.sum[0] * part.sum[0] + part.sum[1] * part.sum[1] + part.sum[2] * part.sum[2]);
    }
    const std::size_t count = kind_ == Kind::color ? std::min<std::size_t>(channels, 3) : channels;
    for (std::size_t c = 0; c < count; ++c) {
        mean[c] = divisor > 0.0F ? part.sum[c] / divisor : 0.0F;
    }
    return static_cast<double>(part.share);
}

} // namespace paradize::gutter
