#include "reference_terrain.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

namespace paradize::reference {
namespace {

constexpr std::size_t band_rows = 64;
constexpr double rim = 1e-9; // of a triangle: how far outside its border a pixel still counts as on it

struct Face {
    double x[3], y[3], z[3], area; // x, z in pixels
};

class Field {
  public:
    Field(std::span<const float> positions, std::span<const std::uint32_t> triangles,
          const HeightField &ground)
        : positions_(positions), triangles_(triangles), ground_(ground),
          slack_(1e-6 * static_cast<double>(std::max(ground.rows, ground.columns))) {}

    Face face(std::size_t triangle) const {
        Face found{};
        for (std::size_t k = 0; k < 3; ++k) {
            const float *at = &positions_[3 * static_cast<std::size_t>(triangles_[3 * triangle + k])];
            found.x[k] = place(at[0], ground_.size_x_m, ground_.columns);
            found.y[k] = static_cast<double>(at[1]);
            found.z[k] = place(at[2], ground_.size_z_m, ground_.rows);
        }
        found.area = (found.x[2] - found.x[0]) * (found.z[1] - found.z[0]) -
                     (found.x[1] - found.x[0]) * (found.z[2] - found.z[0]);
        return found;
    }

    // Rows of pixels that a face may meet: [first, last), empty where there are none.
    std::pair<std::size_t, std::size_t> rows(const Face &face) const {
        return range(std::min({face.z[0], face.z[1], face.z[2]}), std::max({face.z[0], face.z[1], face.z[2]}),
                     ground_.rows);
    }

    // Raises `error`, one value a pixel of the rows [top, bottom), to the face's distance where it covers
    // them.
    void meet(const Face &face, std::size_t top, std::size_t bottom, std::vector<double> &error) const {
        const auto [first, last] = rows(face);
        for (std::size_t row = std::max(first, top); row < std::min(last, bottom); ++row) {
            const double z = static_cast<double>(row);
            double left = static_cast<double>(ground_.columns), right = -1.0;
            for (int k = 0; k < 3; ++k) { // where the row's line, widened by the slack, meets the borders
                const double za = face.z[k], zb = face.z[(k + 1) % 3], xa = face.x[k],
                             xb = face.x[(k + 1) % 3];
                const double from = std::max(std::min(za, zb), z - slack_),
                             to = std::min(std::max(za, zb), z + slack_);
                if (from > to) {
                    continue;
                }
                for (const double at : {from, to}) {
                    const double x = za == zb ? xa : xa + (xb - xa) * ((at - za) / (zb - za));
                    left = std::min({left, x, za == zb ? xb : x});
                    right = std::max({right, x, za == zb ? xb : x});
                }
            }
            const auto [from, to] = range(left, right, ground_.columns);
            const float *heights = &ground_.heights[row * ground_.columns];
            for (std::size_t column = from; column < to; ++column) {
                const double x = static_cast<double>(column);
                double plane = 0.0;
                bool inside = true;
                for (int k = 0; k < 3; ++k) { // the share of corner k: the area that the pixel spans there
                    const int a = (k + 1) % 3, b = (k + 2) % 3;
                    const double share =
                        ((face.x[b] - x) * (face.z[a] - z) - (face.x[a] - x) * (face.z[b] - z)) / face.area;
                    inside = inside && share >= -rim;
                    plane += share * face.y[k];
                }
                if (inside) {
                    double &found = error[(row - top) * ground_.columns + column];
                    found = std::max(found, std::fabs(plane - static_cast<double>(heights[column])));
                }
            }
        }
    }

    GroundError band(std::span<const std::uint32_t> faces, std::size_t top, std::size_t bottom,
                     std::vector<double> &error) const {
        error.assign((bottom - top) * ground_.columns, -1.0);
        for (const std::uint32_t triangle : faces) {
            meet(face(triangle), top, bottom, error);
        }
        GroundError found;
        for (std::size_t row = 0; row < bottom - top; ++row) {
            double squares = 0.0;
            for (std::size_t k = row * ground_.columns; k < (row + 1) * ground_.columns; ++k) {
                if (error[k] < 0.0) {
                    ++found.holes;
                    continue;
                }
                ++found.covered;
                squares += error[k] * error[k];
                if (error[k] > found.max_m) {
                    found.max_m = error[k];
                    found.worst = top * ground_.columns + k;
                }
            }
            found.squares += squares;
        }
        return found;
    }

  private:
    std::span<const float> positions_;
    std::span<const std::uint32_t> triangles_;
    const HeightField &ground_;
    double slack_;

    // Into pixels: a whole number but for the rounding of float32; the rim is where its pixels are.
    double place(float at, double size_m, std::size_t pixels) const {
        const double last = static_cast<double>(pixels - 1);
        const double found = (static_cast<double>(at) / size_m + 0.5) * last;
        if (std::fabs(found) <= slack_) {
            return 0.0;
        }
        return std::fabs(found - last) <= slack_ ? last : found;
    }

    std::pair<std::size_t, std::size_t> range(double low, double high, std::size_t count) const {
        const double from = std::max(std::ceil(low - slack_), 0.0),
                     to = std::min(std::floor(high + slack_), static_cast<double>(count) - 1.0);
        if (!(from <= to)) {
            return {0, 0};
        }
        return {static_cast<std::size_t>(from), static_cast<std::size_t>(to) + 1};
    }
};

} // namespace

GroundError ground_error(std::span<const float> positions, std::span<const std::uint32_t> triangles,
                         const HeightField &ground, int threads) {
    const Field field(positions, triangles, ground);
    const std::size_t bands = (ground.rows + band_rows - 1) / band_rows, count = triangles.size() / 3;
    GroundError whole;
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

    std::vector<GroundError> found(bands);
    const auto hands = static_cast<std::size_t>(std::max(1, std::min(threads, static_cast<int>(bands))));
    const auto work = [&](std::size_t hand) {
        std::vector<double> error;
        for (std::size_t band = hand; band < bands; band += hands) {
            const std::span<const std::uint32_t> faces(order.data() + starts[band],
                                                       starts[band + 1] - starts[band]);
            found[band] =
                field.band(faces, band * band_rows, std::min(ground.rows, (band + 1) * band_rows), error);
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
    for (const GroundError &band : found) {
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
