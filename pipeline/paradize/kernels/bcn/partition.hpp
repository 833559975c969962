// The best line through a block's colours, whatever the places: every way to cut the texels, in their order
// along an axis, into four runs, each judged in closed form. With the texels' mean at zero, the squared error
// that places q leave after least squares falls short of the squares' sum by
//     |sum q v|^2 / (sum q^2 - (sum q)^2 / 16)
// and the sum of q v is that of three prefix sums, one per cut.
#pragma once

#include "bcn/color.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Sorts the texels of every lane by key, upwards: Batcher's odd-even merge network.
PARADIZE_STEP void sort_texels(Lanes (&key)[texels], Lanes (&v)[3][texels]) {
    for (std::size_t p = 1; p < texels; p *= 2) {
        for (std::size_t k = p; k >= 1; k /= 2) {
            for (std::size_t j = k % p; j + k < texels; j += 2 * k) {
                for (std::size_t i = 0; i < k && i + j + k < texels; ++i) {
                    if ((i + j) / (2 * p) != (i + j + k) / (2 * p)) {
                        continue;
                    }
                    const std::size_t x = i + j, y = i + j + k;
                    const auto swap = key[x] > key[y];
                    const Lanes low = swap ? key[y] : key[x];
                    key[y] = swap ? key[x] : key[y];
                    key[x] = low;
                    for (auto &channel : v) {
                        const Lanes other = swap ? channel[y] : channel[x];
                        channel[y] = swap ? channel[x] : channel[y];
                        channel[x] = other;
                    }
                }
            }
        }
    }
}

// The places that leave least along `axis`; ends and error are for the caller to find.
PARADIZE_STEP void best_partition(const ColorBlocks &blocks, const Lanes (&axis)[3], Places &places) {
    Lanes key[texels];
    Lanes v[3][texels];
    for (std::size_t i = 0; i < texels; ++i) {
        key[i] = splat(0.0F);
        for (int k = 0; k < 3; ++k) {
            v[k][i] = blocks.v[k][i];
            key[i] += v[k][i] * axis[k];
        }
    }
    sort_texels(key, v);
    Lanes above[3][texels + 1]; // sum of the texels from the i-th up
    for (int k = 0; k < 3; ++k) {
        above[k][texels] = Lanes{};
        for (std::size_t i = texels; i-- > 0;) {
            above[k][i] = above[k][i + 1] + v[k][i];
        }
    }
    Lanes gain = splat(-1.0F);
    places.q = places.qq = places.qv[0] = places.qv[1] = places.qv[2] = Lanes{};
    // The texels from cut c1, c2, c3 up stand at least at place 1, 2, 3.
    for (std::size_t c1 = 0; c1 <= texels; ++c1) {
        for (std::size_t c2 = c1; c2 <= texels; ++c2) {
            const Lanes r = above[0][c1] + above[0][c2];
            const Lanes g = above[1][c1] + above[1][c2];
            const Lanes b = above[2][c1] + above[2][c2];
            for (std::size_t c3 = c2; c3 <= texels; ++c3) {
                const std::size_t q = 3 * texels - c1 - c2 - c3;
                const std::size_t qq = (c2 - c1) + 4 * (c3 - c2) + 9 * (texels - c3);
                if (16 * qq == q * q) {
                    continue; // all at one place
                }
                const float weight = 16.0F / static_cast<float>(16 * qq - q * q);
                const Lanes qr = r + above[0][c3];
                const Lanes qg = g + above[1][c3];
                const Lanes qb = b + above[2][c3];
                const Lanes now = (qr * qr + qg * qg + qb * qb) * weight;
                const auto better = now > gain;
                gain = better ? now : gain;
                places.q = better ? splat(static_cast<float>(q)) : places.q;
                places.qq = better ? splat(static_cast<float>(qq)) : places.qq;
                places.qv[0] = better ? qr : places.qv[0];
                places.qv[1] = better ? qg : places.qv[1];
                places.qv[2] = better ? qb : places.qv[2];
            }
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
