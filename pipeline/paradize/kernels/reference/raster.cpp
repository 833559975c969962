#include "reference/raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "parallel.hpp"

namespace paradize::reference {
namespace {

constexpr double edge = 1e-9; // of a triangle: so that neighbours leave no gap
constexpr std::uint32_t no_triangle = ~0U;

std::size_t wrapped(double whole, std::size_t count, Wrap wrap) {
    const auto n = static_cast<double>(count);
    if (whole >= 0 && whole < n) {
        return static_cast<std::size_t>(whole); // nearly always
    }
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
    const std::array<std::size_t, 2> columns{wrapped(left, mip.columns, material.across),
                                             wrapped(left + 1, mip.columns, material.across)};
    std::array<double, channels> out{};
    for (std::size_t j = 0; j < 2; ++j) {
        const double down = j ? y - top : 1 - (y - top);
        const std::size_t row = wrapped(top + static_cast<double>(j), mip.rows, material.down);
        for (std::size_t i = 0; i < 2; ++i) {
            const double weight = down * (i ? x - left : 1 - (x - left));
            const float *texel = &mip.texels[(row * mip.columns + columns[i]) * channels];
            for (std::size_t c = 0; c < channels; ++c) {
                out[c] += weight * texel[c];
            }
        }
    }
    return out;
}

// Samples of a tile; the ends are excluded.
struct Samples {
    std::size_t column, columns, row, rows;

    bool empty() const { return columns <= column || rows <= row; }
};

// Which samples of a row may lie in a triangle: most of a box around a narrow one do not.
class RowOfTriangle {
  public:
    explicit RowOfTriangle(const PlacedTriangle &shape) {
        const Pair &a = shape.second_by, &b = shape.third_by;
        const double level = 1e-9 * (std::abs(a[0]) + std::abs(a[1]) + std::abs(b[0]) + std::abs(b[1]));
        by_ = {a, b, {-a[0] - b[0], -a[1] - b[1]}};
        for (std::size_t k = 0; k < 3; ++k) {
            inverse_[k] = std::abs(by_[k][0]) > level ? 1 / by_[k][0] : 0;
        }
    }

    // Of `count` samples from (dx, dy), as seen from the first corner: the first that may lie inside, and the
    // end. With a sample more on each side than lies between the edges: rounding moves no crossing so far,
    // but that of an edge along the row, which narrows nothing.
    std::pair<std::size_t, std::size_t> narrowed(double dx, double dy, std::size_t count) const {
        double low = 0, high = static_cast<double>(count);
        for (std::size_t k = 0; k < 3; ++k) {
            const double distance = (k == 2 ? 1 + edge : edge) + by_[k][0] * dx + by_[k][1] * dy;
            const double crossing = -distance * inverse_[k];
            low = inverse_[k] > 0 ? std::max(low, crossing - 1) : low;
            high = inverse_[k] < 0 ? std::min(high, crossing + 2) : high;
        }
        return low < high ? std::pair(static_cast<std::size_t>(low), static_cast<std::size_t>(high))
                          : std::pair<std::size_t, std::size_t>(0, 0);
    }

  private:
    std::array<Pair, 3> by_;          // what the edges' distances, 0 on them, grow by along x and y
    std::array<double, 3> inverse_{}; // of that along x; 0 where the edge lies along the row
};

} // namespace

Point unit(const Point &v) {
    const double length = std::sqrt(dot(v, v));
    return length > 0 ? Point{v[0] / length, v[1] / length, v[2] / length} : Point{0, 0, 0};
}

View looking(const Point &toward) {
    const Point pole = std::abs(toward[1]) < 0.9 ? Point{0, 1, 0} : Point{0, 0, 1};
    const Point right = unit(cross(pole, toward));
    return {right, cross(toward, right), toward};
}

PlacedTriangle Placed::triangle(std::size_t t) const {
    const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
    const Point &p = at[corner[0]], &q = at[corner[1]], &r = at[corner[2]];
    const double ax = q[0] - p[0], ay = q[1] - p[1], bx = r[0] - p[0], by = r[1] - p[1];
    const double area = ax * by - ay * bx;
    const SeenMaterial &material = mesh.materials[mesh.material[t]];
    PlacedTriangle out{p, {by / area, -bx / area}, {-ay / area, ax / area}, q[2] - p[2], r[2] - p[2]};
    out.back = area < 0;
    out.drawn = area != 0 && std::isfinite(1 / area) && (material.two_sided || !out.back);
    return out;
}

Pair Placed::uv(std::size_t t, const Pair &shares) const {
    const std::uint32_t *corner = &mesh.surface.triangles[t * 3];
    Pair out{};
    for (std::size_t i = 0; i < 2; ++i) {
        const float *uvs = mesh.shading.uvs.data() + i;
        out[i] = (1 - shares[0] - shares[1]) * uvs[corner[0] * std::size_t{2}] +
                 shares[0] * uvs[corner[1] * std::size_t{2}] + shares[1] * uvs[corner[2] * std::size_t{2}];
    }
    return out;
}

const Mip *Placed::level(std::size_t t, const PlacedTriangle &shape, const std::vector<Mip> &chain) const {
    if (chain.empty() || mesh.shading.uvs.empty()) {
        return chain.empty() ? nullptr : &chain.back();
    }
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
    return &chain[k];
}

Point Placed::shown(std::size_t t, const Pair &shares, const Mip *map, double without) const {
    if (map == nullptr) {
        return {without, without, without};
    }
    if (mesh.shading.uvs.empty()) {
        return {map->texels[0], map->texels[1], map->texels[2]};
    }
    return sampled<3>(*map, mesh.materials[mesh.material[t]], uv(t, shares));
}

Point Placed::lit(std::size_t t, const Maps &maps, const Pair &shares, const Point &normal,
                  const SeenLight &light) const {
    const Point color = shown(t, shares, maps.color, 1);
    const Point glow = shown(t, shares, maps.glow, 0);
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

Point Placed::normal(std::size_t t, const PlacedTriangle &shape, const Mip *map, const Pair &shares) const {
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
Placed place(const SeenMesh &mesh, const View &view, int threads) {
    Placed out{mesh, std::vector<Point>(mesh.surface.positions.size() / 3)};
    for_rows(out.at.size(), threads, [&](std::size_t from, std::size_t stop) {
        for (std::size_t k = from; k < stop; ++k) {
            out.at[k] = view.of(&mesh.surface.positions[k * 3]);
        }
    });
    return out;
}

bool Bins::box(std::size_t t, Box &out) const {
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

double Bins::count(std::vector<std::uint32_t> &tiles) const {
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

void Bins::fill(const std::vector<std::size_t> &chosen) {
    std::vector<std::uint32_t> slot(columns_ * rows_, no_triangle);
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
void draw(const Placed &placed, std::span<const std::uint32_t> triangles, std::size_t left,
          std::size_t bottom, std::size_t samples, const SeenLight *light, TilePixels &out) {
    const std::size_t side = tile * samples;
    const auto x0 = static_cast<double>(left), y0 = static_cast<double>(bottom);
    const auto range = [&](double low, double high, double from) {
        const double last = static_cast<double>(side) - 1;
        const double a = std::clamp(std::ceil(low - from - 0.5 - 1e-6), 0.0, last + 1);
        const double b = std::clamp(std::floor(high - from - 0.5 + 1e-6), -1.0, last);
        return std::pair(static_cast<std::size_t>(a), static_cast<std::size_t>(b + 1)); // b + 1 is excluded
    };
    const auto box = [&](std::uint32_t t) {
        const std::uint32_t *corner = &placed.mesh.surface.triangles[t * std::size_t{3}];
        const Point &p = placed.at[corner[0]], &q = placed.at[corner[1]], &r = placed.at[corner[2]];
        const auto [column, columns] = range(std::min({p[0], q[0], r[0]}), std::max({p[0], q[0], r[0]}), x0);
        const auto [row, rows] = range(std::min({p[1], q[1], r[1]}), std::max({p[1], q[1], r[1]}), y0);
        return Samples{column, columns, row, rows};
    };
    Samples all{side, 0, side, 0};
    for (const std::uint32_t t : triangles) {
        const Samples one = box(t);
        if (!one.empty()) {
            all = {std::min(all.column, one.column), std::max(all.columns, one.columns),
                   std::min(all.row, one.row), std::max(all.rows, one.rows)};
        }
    }
    if (all.empty()) {
        return;
    }
    const std::size_t width = all.columns - all.column, count = width * (all.rows - all.row);
    std::vector<double> nearest(count, -std::numeric_limits<double>::infinity());
    std::vector<std::uint32_t> shown(count, no_triangle);
    for (const std::uint32_t t : triangles) {
        const auto [column, columns, row, rows] = box(t);
        if (columns <= column) {
            continue;
        }
        const PlacedTriangle shape = placed.triangle(t);
        const SeenMaterial &material = placed.mesh.materials[placed.mesh.material[t]];
        const Mip *alpha = placed.mesh.shading.uvs.empty() ? nullptr : placed.level(t, shape, material.alpha);
        const RowOfTriangle between(shape);
        for (std::size_t y = row; y < rows; ++y) {
            const auto [first, end] =
                between.narrowed(x0 + static_cast<double>(column) + 0.5 - shape.first[0],
                                 y0 + static_cast<double>(y) + 0.5 - shape.first[1], columns - column);
            for (std::size_t x = column + first; x < column + end; ++x) {
                const Pair s =
                    shape.shares(x0 + static_cast<double>(x) + 0.5, y0 + static_cast<double>(y) + 0.5);
                if (!(s[0] >= -edge && s[1] >= -edge && s[0] + s[1] <= 1 + edge)) {
                    continue;
                }
                const double z = shape.first[2] + s[0] * shape.nearer_second + s[1] * shape.nearer_third;
                const std::size_t at = (y - all.row) * width + x - all.column;
                if (z > nearest[at] &&
                    (alpha == nullptr ||
                     sampled<1>(*alpha, material, placed.uv(t, s))[0] >= material.cutoff)) {
                    nearest[at] = z;
                    shown[at] = t;
                }
            }
        }
    }
    PlacedTriangle shape;
    std::uint32_t last = no_triangle;
    Maps maps;
    const Shading &shading = placed.mesh.shading;
    const bool framed = !shading.uvs.empty() && !shading.tangents.empty();
    for (std::size_t y = all.row; y < all.rows; ++y) {
        for (std::size_t x = all.column; x < all.columns; ++x) {
            const std::uint32_t t = shown[(y - all.row) * width + x - all.column];
            if (t == no_triangle) {
                continue;
            }
            if (t != last) {
                shape = placed.triangle(t);
                const SeenMaterial &material = placed.mesh.materials[placed.mesh.material[t]];
                maps.normal = framed ? placed.level(t, shape, material.normals) : nullptr;
                maps.color = light != nullptr ? placed.level(t, shape, material.colors) : nullptr;
                maps.glow = light != nullptr ? placed.level(t, shape, material.glow) : nullptr;
                last = t;
            }
            const Pair s = shape.shares(x0 + static_cast<double>(x) + 0.5, y0 + static_cast<double>(y) + 0.5);
            const std::size_t pixel = y / samples * tile + x / samples;
            const Point normal = placed.normal(t, shape, maps.normal, s);
            out.normal[pixel] = along(out.normal[pixel], 1, normal);
            if (light != nullptr) {
                out.light[pixel] = along(out.light[pixel], 1, placed.lit(t, maps, s, normal, *light));
            }
            ++out.covered[pixel];
        }
    }
}

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

} // namespace paradize::reference
