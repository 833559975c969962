#include "reference/seen.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "math/functions.hpp"
#include "parallel.hpp"
#include "reference/samples.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t tile = 32;     // pixels along a side
constexpr double most_work = 0x1p29; // samples tested for one picture, about
constexpr double edge = 1e-9;        // of a triangle: so that neighbours leave no gap
constexpr std::uint32_t nothing = ~0U;
constexpr double surely = 1 + 1e-9; // more than sums round

using Pair = std::array<double, 2>;

Point unit(const Point &v) {
    const double length = std::sqrt(dot(v, v));
    return length > 0 ? Point{v[0] / length, v[1] / length, v[2] / length} : Point{0, 0, 0};
}

// The angle whose chord is as long as the difference of two mean normals: their angle where both are unit.
double degrees(const Point &a, const Point &b) {
    const Point off = minus(a, b);
    const double half = 0.5 * std::sqrt(dot(off, off));
    return 2 * mathx::atan2(half, std::sqrt(std::max(0.0, 1 - half * half))) * (180 / mathx::pi);
}

Point mean(const Point &sum, std::uint32_t count) {
    const double n = count;
    return {sum[0] / n, sum[1] / n, sum[2] / n};
}

std::size_t wrapped(double whole, std::size_t count, Wrap wrap) {
    const auto n = static_cast<double>(count);
    if (wrap == Wrap::repeat) {
        whole -= n * std::floor(whole / n);
    } else if (wrap == Wrap::mirror) {
        whole -= 2 * n * std::floor(whole / (2 * n));
        whole = std::min(whole, 2 * n - 1 - whole);
    }
    return static_cast<std::size_t>(std::clamp(whole, 0.0, n - 1));
}

// Bilinear, at texel centres.
template <std::size_t channels>
std::array<double, channels> sampled(const Mip &mip, const SeenMaterial &material, const Pair &uv) {
    const double x = std::clamp(uv[0] * static_cast<double>(mip.columns) - 0.5, -0x1p40, 0x1p40);
    const double y = std::clamp(uv[1] * static_cast<double>(mip.rows) - 0.5, -0x1p40, 0x1p40);
    const double left = std::floor(x), top = std::floor(y);
    std::array<double, channels> out{};
    for (std::size_t j = 0; j < 2; ++j) {
        const double down = j ? y - top : 1 - (y - top);
        const std::size_t row = wrapped(top + static_cast<double>(j), mip.rows, material.down);
        for (std::size_t i = 0; i < 2; ++i) {
            const double weight = down * (i ? x - left : 1 - (x - left));
            const std::size_t column = wrapped(left + static_cast<double>(i), mip.columns, material.across);
            const float *texel = &mip.texels[(row * mip.columns + column) * channels];
            for (std::size_t c = 0; c < channels; ++c) {
                out[c] += weight * texel[c];
            }
        }
    }
    return out;
}

// The axes of a picture and its place: x = (right . p) * scale + left in samples, y upwards, z towards the
// viewer.
struct View {
    Point right, up, toward;
    double scale = 0, left = 0, bottom = 0;

    Point of(const float *p) const {
        const Point at{p[0], p[1], p[2]};
        return {dot(right, at) * scale + left, dot(up, at) * scale + bottom, dot(toward, at)};
    }
};

View looking(const Point &toward) {
    const Point pole = std::abs(toward[1]) < 0.9 ? Point{0, 1, 0} : Point{0, 0, 1};
    const Point right = unit(cross(pole, toward));
    return {right, cross(toward, right), toward};
}

// A triangle in a picture: the shares of its second and third corner are linear in x and y.
struct Triangle {
    Point first{};
    Pair second_by{}, third_by{}; // by x, by y
    double nearer_second = 0, nearer_third = 0;
    bool drawn = false, back = false;

    Pair shares(double x, double y) const {
        const double dx = x - first[0], dy = y - first[1];
        return {second_by[0] * dx + second_by[1] * dy, third_by[0] * dx + third_by[1] * dy};
    }
};

struct Placed {
    const SeenMesh &mesh;
    std::vector<Point> at; // by vertex

    Triangle triangle(std::size_t t) const {
        const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
        const Point &p = at[corner[0]], &q = at[corner[1]], &r = at[corner[2]];
        const double ax = q[0] - p[0], ay = q[1] - p[1], bx = r[0] - p[0], by = r[1] - p[1];
        const double area = ax * by - ay * bx;
        const SeenMaterial &material = mesh.materials[mesh.material[t]];
        Triangle out{p, {by / area, -bx / area}, {-ay / area, ax / area}, q[2] - p[2], r[2] - p[2]};
        out.back = area < 0;
        out.drawn = area != 0 && std::isfinite(1 / area) && (material.two_sided || !out.back);
        return out;
    }

    // Texture coordinates at shares of a triangle.
    Pair uv(std::size_t t, const Pair &shares) const {
        const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
        Pair out{};
        for (std::size_t i = 0; i < 2; ++i) {
            const float *uvs = mesh.shading.uvs.data() + i;
            out[i] = (1 - shares[0] - shares[1]) * uvs[corner[0] * std::size_t{2}] +
                     shares[0] * uvs[corner[1] * std::size_t{2}] +
                     shares[1] * uvs[corner[2] * std::size_t{2}];
        }
        return out;
    }

    // The level of a chain whose texels are about as wide as a sample.
    const Mip &level(std::size_t t, const Triangle &shape, const std::vector<Mip> &chain) const {
        const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
        const auto uvs = mesh.shading.uvs;
        double widest = 0;
        for (std::size_t axis = 0; axis < 2; ++axis) {
            double squared = 0;
            for (std::size_t i = 0; i < 2; ++i) {
                const double from = uvs[corner[0] * std::size_t{2} + i];
                const double step = shape.second_by[axis] * (uvs[corner[1] * std::size_t{2} + i] - from) +
                                    shape.third_by[axis] * (uvs[corner[2] * std::size_t{2} + i] - from);
                const double texels = step * static_cast<double>(i ? chain[0].rows : chain[0].columns);
                squared += texels * texels;
            }
            widest = std::max(widest, squared);
        }
        std::size_t k = 0;
        for (; k + 1 < chain.size() && widest >= 2; widest /= 4) {
            ++k;
        }
        return chain[k];
    }

    // A map of three channels at shares of a triangle. Without texture coordinates: its coarsest level's
    // first.
    Point shown(std::size_t t, const Triangle &shape, const Pair &shares, const std::vector<Mip> &chain,
                double without) const {
        if (chain.empty()) {
            return {without, without, without};
        }
        if (mesh.shading.uvs.empty()) {
            const auto first = chain.back().texels;
            return {first[0], first[1], first[2]};
        }
        return sampled<3>(level(t, shape, chain), mesh.materials[mesh.material[t]], uv(t, shares));
    }

    // What a sample sends to the viewer.
    Point lit(std::size_t t, const Triangle &shape, const Pair &shares, const Point &normal,
              const SeenLight &light) const {
        const SeenMaterial &material = mesh.materials[mesh.material[t]];
        const Point color = shown(t, shape, shares, material.colors, 1);
        const Point glow = shown(t, shape, shares, material.glow, 0);
        const double received =
            light.direct * std::max(0.0, dot(normal, light.toward)) + light.around * (0.5 + 0.5 * normal[1]);
        const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
        const std::array<double, 3> weights{1 - shares[0] - shares[1], shares[0], shares[1]};
        Point out{};
        for (std::size_t c = 0; c < 3; ++c) {
            double painted = mesh.colors.empty() ? 1 : 0;
            for (std::size_t k = 0; k < 3 && !mesh.colors.empty(); ++k) {
                painted += weights[k] * mesh.colors[corner[k] * std::size_t{4} + c];
            }
            out[c] = color[c] * painted * received + glow[c];
        }
        return out;
    }

    Point normal(std::size_t t, const Triangle &shape, const Mip *map, const Pair &shares) const {
        const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
        const std::array<double, 3> weights{1 - shares[0] - shares[1], shares[0], shares[1]};
        const Shading &shading = mesh.shading;
        Point n{};
        for (std::size_t k = 0; k < 3 && !shading.normals.empty(); ++k) {
            const float *of = &shading.normals[corner[k] * std::size_t{3}];
            n = along(n, weights[k], {of[0], of[1], of[2]});
        }
        if (dot(n, n) <= 1e-24) {
            const Corners c = corners_of(mesh.surface, t);
            n = cross(minus(c[1], c[0]), minus(c[2], c[0]));
        }
        n = unit(n);
        if (map != nullptr) {
            Point tangent{};
            double side = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const float *of = &shading.tangents[corner[k] * std::size_t{4}];
                tangent = along(tangent, weights[k], {of[0], of[1], of[2]});
                side += weights[k] * of[3];
            }
            tangent = unit(tangent);
            const Point bitangent = cross(n, tangent);
            const auto texel = sampled<3>(*map, mesh.materials[mesh.material[t]], uv(t, shares));
            const Point m = unit({texel[0], texel[1], texel[2]});
            const Point turned = along(along({m[2] * n[0], m[2] * n[1], m[2] * n[2]}, m[0], tangent),
                                       side < 0 ? -m[1] : m[1], bitangent);
            n = dot(turned, turned) > 1e-24 ? unit(turned) : n;
        }
        return shape.back ? Point{-n[0], -n[1], -n[2]} : n;
    }
};

// Which triangles lie in which tile. Tiles are numbered row by row.
struct Box {
    std::size_t left, right, bottom, top; // the last ones included
};

class Bins {
  public:
    Bins(const Placed &placed, std::size_t columns, std::size_t rows, double side)
        : placed_(placed), columns_(columns), rows_(rows), side_(side) {}

    bool box(std::size_t t, Box &out) const {
        const std::uint32_t *corner = &placed_.mesh.surface.triangles[t * 3];
        const Point &p = placed_.at[corner[0]], &q = placed_.at[corner[1]], &r = placed_.at[corner[2]];
        const auto at = [&](double v, std::size_t count) {
            return static_cast<std::size_t>(
                std::clamp(std::floor(v / side_), 0.0, static_cast<double>(count - 1)));
        };
        out = {at(std::min({p[0], q[0], r[0]}), columns_), at(std::max({p[0], q[0], r[0]}), columns_),
               at(std::min({p[1], q[1], r[1]}), rows_), at(std::max({p[1], q[1], r[1]}), rows_)};
        return placed_.triangle(t).drawn;
    }

    // Adds the number of triangles in each tile, and returns how many samples their boxes hold.
    double count(std::vector<std::uint32_t> &tiles) const {
        std::vector<std::int64_t> steps((columns_ + 1) * (rows_ + 1), 0);
        const std::size_t count = placed_.mesh.surface.triangles.size() / 3;
        double work = 0;
        for (std::size_t t = 0; t < count; ++t) {
            Box b;
            if (!box(t, b)) {
                continue;
            }
            ++steps[b.bottom * (columns_ + 1) + b.left];
            --steps[b.bottom * (columns_ + 1) + b.right + 1];
            --steps[(b.top + 1) * (columns_ + 1) + b.left];
            ++steps[(b.top + 1) * (columns_ + 1) + b.right + 1];
            const std::uint32_t *corner = &placed_.mesh.surface.triangles[t * 3];
            const Point &p = placed_.at[corner[0]], &q = placed_.at[corner[1]], &r = placed_.at[corner[2]];
            work += (std::max({p[0], q[0], r[0]}) - std::min({p[0], q[0], r[0]})) *
                    (std::max({p[1], q[1], r[1]}) - std::min({p[1], q[1], r[1]}));
        }
        std::vector<std::int64_t> above(columns_ + 1, 0);
        for (std::size_t row = 0; row < rows_; ++row) {
            std::int64_t sum = 0;
            for (std::size_t column = 0; column < columns_; ++column) {
                above[column] += steps[row * (columns_ + 1) + column];
                sum += above[column];
                tiles[row * columns_ + column] += static_cast<std::uint32_t>(sum);
            }
        }
        return work;
    }

    // Lists the triangles of the tiles in `chosen` (rising); `first` has one more than these.
    void fill(const std::vector<std::size_t> &chosen) {
        std::vector<std::uint32_t> slot(columns_ * rows_, nothing);
        for (std::size_t k = 0; k < chosen.size(); ++k) {
            slot[chosen[k]] = static_cast<std::uint32_t>(k);
        }
        first.assign(chosen.size() + 1, 0);
        const std::size_t count = placed_.mesh.surface.triangles.size() / 3;
        const auto each = [&](auto &&work) {
            for (std::size_t t = 0; t < count; ++t) {
                Box b;
                if (!box(t, b)) {
                    continue;
                }
                auto at = std::ranges::lower_bound(chosen, b.bottom * columns_ + b.left);
                while (at != chosen.end() && *at <= b.top * columns_ + b.right) {
                    const std::size_t row = *at / columns_, column = *at % columns_;
                    if (column < b.left || column > b.right) {
                        const std::size_t next = (column < b.left ? row : row + 1) * columns_ + b.left;
                        at = std::lower_bound(at, chosen.end(), next);
                        continue;
                    }
                    work(slot[*at], static_cast<std::uint32_t>(t));
                    ++at;
                }
            }
        };
        each([&](std::uint32_t k, std::uint32_t) { ++first[k + 1]; });
        for (std::size_t k = 0; k < chosen.size(); ++k) {
            first[k + 1] += first[k];
        }
        triangles.resize(first.back());
        std::vector<std::size_t> next(first.begin(), first.end() - 1);
        each([&](std::uint32_t k, std::uint32_t t) { triangles[next[k]++] = t; });
    }

    std::vector<std::size_t> first;
    std::vector<std::uint32_t> triangles;

  private:
    const Placed &placed_;
    std::size_t columns_, rows_;
    double side_; // samples
};

// The pixels of a tile: the sums of the normals and of the light of their samples, and how many are covered.
struct Pixels {
    std::array<Point, tile * tile> normal{}, light{};
    std::array<std::uint32_t, tile * tile> covered{};
};

// left, bottom: first sample of the tile. light: null where nobody asks for it.
void draw(const Placed &placed, std::span<const std::uint32_t> triangles, std::size_t left,
          std::size_t bottom, std::size_t samples, const SeenLight *light, Pixels &out) {
    const std::size_t side = tile * samples;
    std::vector<double> nearest(side * side, -std::numeric_limits<double>::infinity());
    std::vector<std::uint32_t> shown(side * side, nothing);
    const auto x0 = static_cast<double>(left), y0 = static_cast<double>(bottom);
    const auto range = [&](double low, double high, double from) {
        const double last = static_cast<double>(side) - 1;
        const double a = std::clamp(std::ceil(low - from - 0.5 - 1e-6), 0.0, last + 1);
        const double b = std::clamp(std::floor(high - from - 0.5 + 1e-6), -1.0, last);
        return std::pair(static_cast<std::size_t>(a), static_cast<std::size_t>(b + 1)); // b + 1 is excluded
    };
    for (const std::uint32_t t : triangles) {
        const Triangle shape = placed.triangle(t);
        const std::uint32_t *corner = &placed.mesh.surface.triangles[t * std::size_t{3}];
        const Point &p = placed.at[corner[0]], &q = placed.at[corner[1]], &r = placed.at[corner[2]];
        const auto [column, columns] = range(std::min({p[0], q[0], r[0]}), std::max({p[0], q[0], r[0]}), x0);
        const auto [row, rows] = range(std::min({p[1], q[1], r[1]}), std::max({p[1], q[1], r[1]}), y0);
        const SeenMaterial &material = placed.mesh.materials[placed.mesh.material[t]];
        const bool holes = !material.alpha.empty() && !placed.mesh.shading.uvs.empty();
        const Mip *alpha = holes ? &placed.level(t, shape, material.alpha) : nullptr;
        for (std::size_t y = row; y < rows; ++y) {
            for (std::size_t x = column; x < columns; ++x) {
                const Pair s =
                    shape.shares(x0 + static_cast<double>(x) + 0.5, y0 + static_cast<double>(y) + 0.5);
                if (!(s[0] >= -edge && s[1] >= -edge && s[0] + s[1] <= 1 + edge)) {
                    continue;
                }
                const double z = shape.first[2] + s[0] * shape.nearer_second + s[1] * shape.nearer_third;
                const std::size_t at = y * side + x;
                if (z > nearest[at] &&
                    (alpha == nullptr ||
                     sampled<1>(*alpha, material, placed.uv(t, s))[0] >= material.cutoff)) {
                    nearest[at] = z;
                    shown[at] = t;
                }
            }
        }
    }
    Triangle shape;
    std::uint32_t last = nothing;
    const Mip *map = nullptr;
    const Shading &shading = placed.mesh.shading;
    const bool framed = !shading.uvs.empty() && !shading.tangents.empty();
    for (std::size_t y = 0; y < side; ++y) {
        for (std::size_t x = 0; x < side; ++x) {
            const std::uint32_t t = shown[y * side + x];
            if (t == nothing) {
                continue;
            }
            if (t != last) {
                shape = placed.triangle(t);
                const std::vector<Mip> &chain = placed.mesh.materials[placed.mesh.material[t]].normals;
                map = framed && !chain.empty() ? &placed.level(t, shape, chain) : nullptr;
                last = t;
            }
            const Pair s = shape.shares(x0 + static_cast<double>(x) + 0.5, y0 + static_cast<double>(y) + 0.5);
            const std::size_t pixel = y / samples * tile + x / samples;
            const Point normal = placed.normal(t, shape, map, s);
            out.normal[pixel] = along(out.normal[pixel], 1, normal);
            if (light != nullptr) {
                out.light[pixel] = along(out.light[pixel], 1, placed.lit(t, shape, s, normal, *light));
            }
            ++out.covered[pixel];
        }
    }
}

// What is measured of pictures, pixel by pixel.
struct Found {
    std::vector<double> angle, weight;
    double covered = 0, changed = 0, box = 0;
};

SeenDifference difference_of(const Found &found) {
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

Placed place(const SeenMesh &mesh, const View &view, int threads) {
    Placed out{mesh, std::vector<Point>(mesh.surface.positions.size() / 3)};
    for_rows(out.at.size(), threads, [&](std::size_t from, std::size_t stop) {
        for (std::size_t k = from; k < stop; ++k) {
            out.at[k] = view.of(&mesh.surface.positions[k * 3]);
        }
    });
    return out;
}

// Evenly spread over the tiles that are not empty.
std::vector<std::size_t> some(const std::vector<std::uint32_t> &tiles, double share) {
    std::vector<std::size_t> full;
    for (std::size_t k = 0; k < tiles.size(); ++k) {
        if (tiles[k] > 0) {
            full.push_back(k);
        }
    }
    const auto wanted = static_cast<std::size_t>(share * static_cast<double>(full.size()));
    const std::size_t count =
        std::clamp<std::size_t>(wanted, std::min<std::size_t>(1, full.size()), full.size());
    std::vector<std::size_t> out(count);
    for (std::size_t k = 0; k < count; ++k) {
        out[k] = full[(2 * k + 1) * full.size() / (2 * count)];
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

Found compare(const SeenMesh &a, const SeenMesh &b, const Picture &picture, std::size_t samples,
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

    std::vector<Found> by_tile(chosen.size());
    for_each_job(chosen.size(), threads, [&](std::size_t k) {
        const std::size_t left = chosen[k] % columns * tile * samples,
                          bottom = chosen[k] / columns * tile * samples;
        Pixels one, other;
        const auto own = [&](const Bins &bins) {
            return std::span(bins.triangles).subspan(bins.first[k], bins.first[k + 1] - bins.first[k]);
        };
        draw(first, own(of_first), left, bottom, samples, nullptr, one);
        draw(second, own(of_second), left, bottom, samples, nullptr, other);
        const double whole = static_cast<double>(samples * samples);
        Found &found = by_tile[k];
        for (std::size_t p = 0; p < tile * tile; ++p) {
            const double here = one.covered[p] / whole, there = other.covered[p] / whole;
            found.covered += here;
            found.changed += std::abs(here - there);
            if (here > 0 && there > 0) {
                found.angle.push_back(
                    degrees(mean(one.normal[p], one.covered[p]), mean(other.normal[p], other.covered[p])));
                found.weight.push_back(std::min(here, there));
            }
        }
    });
    Found out;
    out.box = sides[0] * sides[1] / static_cast<double>(samples * samples) *
              static_cast<double>(chosen.size()) / std::max(1.0, full);
    for (const Found &found : by_tile) {
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
    Found all;
    double weight = 0, beyond = 0; // of the angles so far, and of those beyond the limit
    for (const Picture &one : pictures) {
        const Found found = compare(a, b, one, samples, most_tiles, threads);
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
            Pixels drawn;
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
