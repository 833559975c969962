#include "reference/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "reference/terrain_field.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t band_rows = 64;

TerrainError band_error(const Field &field, std::span<const std::uint32_t> faces, const Window &band,
                        std::vector<double> &error) {
    error.assign(band.count(), -1.0);
    for (const std::uint32_t triangle : faces) {
        field.meet(field.face(triangle), band, error);
    }
    TerrainError found;
    for (std::size_t row = 0; row < band.bottom - band.top; ++row) {
        double squares = 0.0;
        for (std::size_t k = row * band.right; k < (row + 1) * band.right; ++k) {
            if (error[k] < 0.0) {
                ++found.holes;
                continue;
            }
            ++found.covered;
            squares += error[k] * error[k];
            if (error[k] > found.max_m) {
                found.max_m = error[k];
                found.worst = band.top * band.right + k;
            }
        }
        found.squares += squares;
    }
    return found;
}

} // namespace

TerrainError terrain_error(std::span<const float> positions, std::span<const std::uint32_t> triangles,
                           const HeightField &height_field, int threads) {
    const Field field(positions, triangles, height_field);
    const std::size_t bands = (height_field.rows + band_rows - 1) / band_rows, count = triangles.size() / 3;
    TerrainError whole;
    std::vector<std::size_t> starts(bands + 1, 0); // of each band's triangles in `order`
    const auto for_bands = [&](auto &&act) {
        for (std::size_t triangle = 0; triangle < count; ++triangle) {
            const Face face = field.face(triangle);
            const auto [first, last] = field.rows(face);
            if (face.area > 0.0 && first < last) {
                for (std::size_t band = first / band_rows; band <= (last - 1) / band_rows; ++band) {
                    act(band, triangle);
                }
            } else if (!(face.area > 0.0)) {
                ++whole.flipped;
            }
        }
    };
    for_bands([&](std::size_t band, std::size_t) { ++starts[band + 1]; });
    for (std::size_t band = 0; band < bands; ++band) {
        starts[band + 1] += starts[band];
    }
    std::vector<std::uint32_t> order(starts[bands]);
    std::vector<std::size_t> ends(starts.begin(), starts.end() - 1);
    whole.flipped = 0;
    for_bands([&](std::size_t band, std::size_t triangle) {
        order[ends[band]++] = static_cast<std::uint32_t>(triangle);
    });

    std::vector<TerrainError> found(bands);
    const auto hands = static_cast<std::size_t>(std::max(1, std::min(threads, static_cast<int>(bands))));
    const auto work = [&](std::size_t hand) {
        std::vector<double> error;
        for (std::size_t band = hand; band < bands; band += hands) {
            const std::span<const std::uint32_t> faces(order.data() + starts[band],
                                                       starts[band + 1] - starts[band]);
            const Window window{band * band_rows, std::min(height_field.rows, (band + 1) * band_rows), 0,
                                height_field.columns};
            found[band] = band_error(field, faces, window, error);
        }
    };
    std::vector<std::thread> others;
    for (std::size_t hand = 1; hand < hands; ++hand) {
        others.emplace_back(work, hand);
    }
    work(0);
    for (std::thread &other : others) {
        other.join();
    }
    for (const TerrainError &band : found) {
        if (band.max_m > whole.max_m) {
            whole.max_m = band.max_m;
            whole.worst = band.worst;
        }
        whole.squares += band.squares;
        whole.covered += band.covered;
        whole.holes += band.holes;
    }
    return whole;
}

} // namespace paradize::reference
