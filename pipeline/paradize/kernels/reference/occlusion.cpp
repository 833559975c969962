#include "reference/occlusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "math/vec.hpp"
#include "parallel.hpp"

namespace paradize::reference {
namespace {

using mesh::Vec;

Vec row(std::span<const double> rows, std::size_t i) {
    return {rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]};
}

// From, to: the cells whose directions may have a component along an axis as those within an angle of a
// direction do. along: its own component; cosine, sine: of the angle.
std::array<std::size_t, 2> cells_near(double along, double cosine, double sine, std::size_t cells) {
    const double across = sine * std::sqrt(std::max(0.0, 1 - along * along)), middle = along * cosine;
    const double most = along >= cosine ? 1.0 : middle + across;
    const double least = along <= -cosine ? -1.0 : middle - across;
    const double n = static_cast<double>(cells);
    const auto cell = [&](double at) { return std::clamp((at + 1) * 0.5 * n, 0.0, n); };
    return {static_cast<std::size_t>(std::max(0.0, std::floor(cell(least)) - 1)),
            std::min(cells, static_cast<std::size_t>(std::ceil(cell(most))) + 1)};
}

class Disk {
  public:
    explicit Disk(std::size_t cells) : cells_(cells), z_(cells * cells), at_(cells) {
        for (std::size_t i = 0; i < cells; ++i) {
            at_[i] = (2 * static_cast<double>(i) + 1) / static_cast<double>(cells) - 1;
        }
        for (std::size_t j = 0; j < cells; ++j) {
            for (std::size_t i = 0; i < cells; ++i) {
                const double squared = 1 - at_[i] * at_[i] - at_[j] * at_[j];
                z_[j * cells + i] = squared > 0 ? std::sqrt(squared) : -1;
            }
        }
    }

    double open_share(Vec point, Vec normal, Vec face, std::span<const double> corners, double reach,
                      std::vector<std::uint8_t> &state) const {
        const Vec t = mesh::any_perpendicular(normal), b = cross(normal, t);
        const auto turned = [&](Vec v) { return Vec{dot(t, v), dot(b, v), dot(normal, v)}; };
        const Vec up = turned(face);
        std::size_t all = 0;
        for (std::size_t j = 0; j < cells_; ++j) {
            for (std::size_t i = 0; i < cells_; ++i) {
                const double z = z_[j * cells_ + i];
                const bool counts = z > 0 && dot(up, {at_[i], at_[j], z}) > 0;
                state[j * cells_ + i] = counts ? 1 : 0;
                all += counts ? 1 : 0;
            }
        }
        if (all == 0) {
            return 1;
        }
        for (std::size_t m = 0; m + 8 < corners.size(); m += 9) {
            const std::array<Vec, 3> p{turned(Vec{corners[m], corners[m + 1], corners[m + 2]} - point),
                                       turned(Vec{corners[m + 3], corners[m + 4], corners[m + 5]} - point),
                                       turned(Vec{corners[m + 6], corners[m + 7], corners[m + 8]} - point)};
            if (p[0].z <= 0 && p[1].z <= 0 && p[2].z <= 0) {
                continue;
            }
            cover(p, reach, state);
        }
        const auto open = std::count(state.begin(), state.end(), std::uint8_t{1});
        return static_cast<double>(open) / static_cast<double>(all);
    }

  private:
    // Marks the cells that a triangle hides.
    void cover(const std::array<Vec, 3> &p, double reach, std::vector<std::uint8_t> &state) const {
        const Vec n = cross(p[1] - p[0], p[2] - p[0]);
        const double height = dot(n, p[0]);
        if (std::fabs(height) > reach * length(n)) {
            return;
        }
        const Vec a = unit(p[0]), b = unit(p[1]), c = unit(p[2]);
        const Vec axis = unit(a + b + c);
        const double cosine = std::min({dot(axis, a), dot(axis, b), dot(axis, c)}) - 1e-12;
        std::array<std::size_t, 2> across{0, cells_}, down{0, cells_};
        if (cosine > 0.01) { // else the triangle may pass behind the point: every cell is tried
            const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine)) + 1e-9;
            across = cells_near(axis.x, cosine, sine, cells_);
            down = cells_near(axis.y, cosine, sine, cells_);
        }
        const Vec u = cross(p[0], p[1]), v = cross(p[1], p[2]), w = cross(p[2], p[0]);
        for (std::size_t j = down[0]; j < down[1]; ++j) {
            for (std::size_t i = across[0]; i < across[1]; ++i) {
                std::uint8_t &cell = state[j * cells_ + i];
                if (cell != 1) {
                    continue;
                }
                const Vec d{at_[i], at_[j], z_[j * cells_ + i]};
                const double e = dot(u, d), f = dot(v, d), g = dot(w, d);
                if (!((e >= 0 && f >= 0 && g >= 0) || (e <= 0 && f <= 0 && g <= 0))) {
                    continue;
                }
                const double distance = height / dot(n, d);
                if (distance > 0 && distance <= reach) {
                    cell = 2;
                }
            }
        }
    }

    std::size_t cells_;
    std::vector<double> z_, at_;
};

} // namespace

void open_shares(std::span<const double> points, std::span<const double> normals,
                 std::span<const double> faces, std::span<const double> corners, double reach,
                 std::size_t cells, std::span<double> out, int threads) {
    const Disk disk(cells);
    for_each_job(out.size(), threads, [&](std::size_t i) {
        std::vector<std::uint8_t> state(cells * cells);
        out[i] = disk.open_share(row(points, i), row(normals, i), row(faces, i), corners, reach, state);
    });
}

} // namespace paradize::reference
