#include "reference/seen.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "math/functions.hpp"
#include "parallel.hpp"
#include "reference/raster.hpp"
#include "reference/samples.hpp"

namespace paradize::reference {
namespace {

constexpr double most_work = 0x1p29; // samples tested for one picture, about
constexpr double surely = 1 + 1e-9;  // more than sums round

// The angle whose chord is as long as the difference of two mean normals: their angle where both are unit.
double chord_degrees(const Point &a, const Point &b) {
    const Point off = minus(a, b);
    const double half = 0.5 * std::sqrt(dot(off, off));
    return 2 * mathx::atan2(half, std::sqrt(std::max(0.0, 1 - half * half))) * (180 / mathx::pi);
}

Point mean(const Point &sum, std::uint32_t count) {
    const double n = count;
    return {sum[0] / n, sum[1] / n, sum[2] / n};
}

// Measurements of pictures, pixel by pixel.
struct PictureSums {
    std::vector<double> angle, weight;
    double covered = 0, changed = 0, box = 0;
};

SeenDifference difference_of(const PictureSums &found) {
    SeenDifference out{0, 0, 0, found.covered, found.changed, found.box};
    double sum = 0, whole = 0;
    for (std::size_t k = 0; k < found.angle.size(); ++k) {
        sum += found.angle[k] * found.weight[k];
        whole += found.weight[k];
        out.max = std::max(out.max, found.angle[k]);
    }
    if (whole > 0) {
        out.mean = sum / whole;
        out.p99 = quantile(found.angle, 0.99, [&](std::size_t k) { return found.weight[k]; });
    }
    return out;
}

// A view that begins at the triangles, and the sides of the rectangle around them in samples.
struct Picture {
    View view;
    Pair sides{};

    // No measured rectangle is larger, and no more pixels are covered.
    double most_pixels(std::size_t samples) const {
        const auto along = [&](std::size_t axis) { return sides[axis] / static_cast<double>(samples) + 2; };
        return along(0) * along(1);
    }
};

Picture picture(const SeenMesh &a, const SeenMesh &b, const Point &toward, double pixel,
                std::size_t samples) {
    View view = looking(toward);
    view.scale = static_cast<double>(samples) / pixel;
    double low[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    double high[2] = {-low[0], -low[1]};
    for (const SeenMesh *mesh : {&a, &b}) {
        for (const std::uint32_t corner : mesh->surface.triangles) {
            const Point p = view.of(&mesh->surface.positions[corner * std::size_t{3}]);
            for (std::size_t axis = 0; axis < 2; ++axis) {
                low[axis] = std::min(low[axis], p[axis]);
                high[axis] = std::max(high[axis], p[axis]);
            }
        }
    }
    // Half a pixel of room, and a little more: no edge lies on samples by chance.
    view.left = (0.5 + 0.0717) * static_cast<double>(samples) - low[0];
    view.bottom = (0.5 + 0.0393) * static_cast<double>(samples) - low[1];
    return {view, {high[0] - low[0], high[1] - low[1]}};
}

// The bounding box of a mesh's triangles.
std::pair<std::array<float, 3>, std::array<float, 3>> box_of(const SeenMesh &mesh) {
    constexpr float far = std::numeric_limits<float>::infinity();
    std::array<float, 3> low{far, far, far}, high{-far, -far, -far};
    for (const std::uint32_t corner : mesh.surface.triangles) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float at = mesh.surface.positions[corner * std::size_t{3} + axis];
            low[axis] = std::min(low[axis], at);
            high[axis] = std::max(high[axis], at);
        }
    }
    return {low, high};
}

PictureSums compare(const SeenMesh &a, const SeenMesh &b, const Picture &picture, std::size_t samples,
                    std::size_t most_tiles, int threads) {
    const auto &[view, sides] = picture;
    const double side = static_cast<double>(tile * samples);
    const auto across = [&, &sides = sides](std::size_t axis) {
        return static_cast<std::size_t>((sides[axis] + static_cast<double>(2 * samples)) / side) + 1;
    };
    const std::size_t columns = across(0), rows = across(1);
    const Placed first = place(a, view, threads), second = place(b, view, threads);
    Bins of_first(first, columns, rows, side), of_second(second, columns, rows, side);
    std::vector<std::uint32_t> tiles(columns * rows, 0);
    const double work = of_first.count(tiles) + of_second.count(tiles);
    const auto full =
        static_cast<double>(tiles.size() - static_cast<std::size_t>(std::ranges::count(tiles, 0U)));
    const double share = std::min(
        {1.0, static_cast<double>(most_tiles) / std::max(1.0, full), most_work / std::max(1.0, work)});
    const std::vector<std::size_t> chosen = some(tiles, share);
    of_first.fill(chosen);
    of_second.fill(chosen);

    std::vector<PictureSums> by_tile(chosen.size());
    for_each_job(chosen.size(), threads, [&](std::size_t k) {
        const std::size_t left = chosen[k] % columns * tile * samples,
                          bottom = chosen[k] / columns * tile * samples;
        TilePixels one, other;
        const auto own = [&](const Bins &bins) {
            return std::span(bins.triangles).subspan(bins.first[k], bins.first[k + 1] - bins.first[k]);
        };
        draw(first, own(of_first), left, bottom, samples, nullptr, one);
        draw(second, own(of_second), left, bottom, samples, nullptr, other);
        const double whole = static_cast<double>(samples * samples);
        PictureSums &found = by_tile[k];
        for (std::size_t p = 0; p < tile * tile; ++p) {
            const double here = one.covered[p] / whole, there = other.covered[p] / whole;
            found.covered += here;
            found.changed += std::abs(here - there);
            if (here > 0 && there > 0) {
                found.angle.push_back(chord_degrees(mean(one.normal[p], one.covered[p]),
                                                    mean(other.normal[p], other.covered[p])));
                found.weight.push_back(std::min(here, there));
            }
        }
    });
    PictureSums out;
    out.box = sides[0] * sides[1] / static_cast<double>(samples * samples) *
              static_cast<double>(chosen.size()) / std::max(1.0, full);
    for (const PictureSums &found : by_tile) {
        out.angle.insert(out.angle.end(), found.angle.begin(), found.angle.end());
        out.weight.insert(out.weight.end(), found.weight.begin(), found.weight.end());
        out.covered += found.covered;
        out.changed += found.changed;
    }
    return out;
}

} // namespace

std::vector<SeenDifference> seen_differences(const SeenMesh &a, const SeenMesh &b,
                                             std::span<const double> directions, double pixel,
                                             std::size_t samples, std::size_t most_tiles,
                                             const SeenLimits &limits, int threads) {
    std::vector<Picture> pictures;
    double to_come = 0; // pixels of the pictures that are not measured yet, at most
    for (std::size_t k = 0; k + 2 < directions.size(); k += 3) {
        const Point toward = unit({directions[k], directions[k + 1], directions[k + 2]});
        pictures.push_back(picture(a, b, toward, pixel, samples));
        to_come += pictures.back().most_pixels(samples);
    }
    std::vector<SeenDifference> out;
    PictureSums all;
    double weight = 0, beyond = 0; // of the angles so far, and of those beyond the limit
    for (const Picture &one : pictures) {
        const PictureSums found = compare(a, b, one, samples, most_tiles, threads);
        out.push_back(difference_of(found));
        all.angle.insert(all.angle.end(), found.angle.begin(), found.angle.end());
        all.weight.insert(all.weight.end(), found.weight.begin(), found.weight.end());
        all.covered += found.covered;
        all.changed += found.changed;
        all.box += found.box;
        to_come -= one.most_pixels(samples);
        for (std::size_t k = 0; k < found.angle.size(); ++k) {
            weight += found.weight[k];
            beyond += found.angle[k] > limits.p99 ? found.weight[k] : 0;
        }
        // However alike the other pictures are.
        const double room = std::max(to_come, 0.0) * surely;
        if (beyond > 0.01 * surely * (weight + room) ||
            all.changed > limits.changed * surely * (all.box + room)) {
            return {};
        }
    }
    out.push_back(difference_of(all));
    return out;
}

LitPair lit_pictures(const SeenMesh &a, const SeenMesh &b, const Point &toward, double pixel,
                     std::size_t samples, std::size_t margin, const SeenLight &light) {
    auto [view, sides] = picture(a, b, unit(toward), pixel, samples);
    view.left += static_cast<double>(margin * samples);
    view.bottom += static_cast<double>(margin * samples);
    const auto pixels = [&, &sides = sides](std::size_t axis) {
        return static_cast<std::size_t>(sides[axis] / static_cast<double>(samples)) + 2 + 2 * margin;
    };
    const std::size_t width = pixels(0), height = pixels(1);
    const std::size_t columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
    LitPair out;
    for (const bool is_first : {true, false}) {
        const Placed placed = place(is_first ? a : b, view, 1);
        Bins bins(placed, columns, rows, static_cast<double>(tile * samples));
        std::vector<std::uint32_t> counts(columns * rows, 0);
        bins.count(counts);
        const std::vector<std::size_t> chosen = some(counts, 1);
        bins.fill(chosen);
        LitPicture &shown = is_first ? out.first : out.second;
        shown = {std::vector<float>(width * height * 4, 0), height, width};
        const auto whole = static_cast<double>(samples * samples);
        for (std::size_t k = 0; k < chosen.size(); ++k) {
            const std::size_t left = chosen[k] % columns * tile, bottom = chosen[k] / columns * tile;
            TilePixels drawn;
            draw(placed, std::span(bins.triangles).subspan(bins.first[k], bins.first[k + 1] - bins.first[k]),
                 left * samples, bottom * samples, samples, &light, drawn);
            for (std::size_t y = 0; y < std::min(tile, height - bottom); ++y) {
                for (std::size_t x = 0; x < std::min(tile, width - left); ++x) {
                    const std::size_t from = y * tile + x;
                    float *to = &shown.pixels[((bottom + y) * width + left + x) * 4];
                    for (std::size_t c = 0; c < 3; ++c) {
                        to[c] = static_cast<float>(drawn.light[from][c] / whole);
                    }
                    to[3] = static_cast<float>(drawn.covered[from] / whole);
                }
            }
        }
    }
    const auto [low, high] = box_of(a);
    out.low.fill(std::numeric_limits<double>::infinity());
    out.high.fill(-std::numeric_limits<double>::infinity());
    for (unsigned corner = 0; corner < 8; ++corner) {
        std::array<float, 3> at{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            at[axis] = corner >> axis & 1U ? high[axis] : low[axis];
        }
        const Point p = view.of(at.data());
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double pixel_of = p[axis] / static_cast<double>(samples);
            out.low[axis] = std::min(out.low[axis], std::floor(pixel_of));
            out.high[axis] = std::max(out.high[axis], std::floor(pixel_of) + 1);
        }
    }
    return out;
}

} // namespace paradize::reference
