#include "terrain/vertices.hpp"

#include <algorithm>
#include <cmath>

#include "parallel.hpp"

namespace paradize::terrain {
namespace {

class Maker {
  public:
    Maker(const HeightField &height_field, const VertexArrays &out)
        : height_field_(height_field), out_(out), last_row_(static_cast<double>(height_field.rows - 1)),
          last_column_(static_cast<double>(height_field.columns - 1)),
          step_x_(height_field.size_x_m / last_column_), step_z_(height_field.size_z_m / last_row_),
          repeat_z_(height_field.sand_repeat * (height_field.size_z_m / height_field.size_x_m)) {}

    void make(std::size_t row, std::size_t column, std::size_t vertex) const {
        const std::size_t left = std::max<std::size_t>(column, 1) - 1,
                          right = std::min(column + 1, height_field_.columns - 1);
        const std::size_t above = std::max<std::size_t>(row, 1) - 1,
                          below = std::min(row + 1, height_field_.rows - 1);
        const double along_x =
            (height(row, right) - height(row, left)) / (static_cast<double>(right - left) * step_x_);
        const double along_z =
            (height(below, column) - height(above, column)) / (static_cast<double>(below - above) * step_z_);
        const double u = static_cast<double>(column) / last_column_, v = static_cast<double>(row) / last_row_;
        float *position = out_.positions + 3 * vertex, *normal = out_.normals + 3 * vertex,
              *tangent = out_.tangents + 4 * vertex, *uv = out_.uvs + 2 * vertex,
              *uv1 = out_.uvs1 + 2 * vertex;
        position[0] = static_cast<float>((u - 0.5) * height_field_.size_x_m);
        position[1] = height_field_.heights[row * height_field_.columns + column];
        position[2] = static_cast<float>((v - 0.5) * height_field_.size_z_m);
        const double length = std::sqrt(along_x * along_x + along_z * along_z + 1.0);
        normal[0] = static_cast<float>(-along_x / length);
        normal[1] = static_cast<float>(1.0 / length);
        normal[2] = static_cast<float>(-along_z / length);
        const double run = std::sqrt(along_x * along_x + 1.0);
        tangent[0] = static_cast<float>(1.0 / run);
        tangent[1] = static_cast<float>(along_x / run);
        tangent[2] = 0.0F;
        tangent[3] = 1.0F;
        uv[0] = static_cast<float>(u * height_field_.sand_repeat);
        uv[1] = static_cast<float>(v * repeat_z_);
        uv1[0] = static_cast<float>(u);
        uv1[1] = static_cast<float>(v);
    }

  private:
    const HeightField &height_field_;
    VertexArrays out_;
    double last_row_, last_column_, step_x_, step_z_, repeat_z_;

    double height(std::size_t row, std::size_t column) const {
        return static_cast<double>(height_field_.heights[row * height_field_.columns + column]);
    }
};

} // namespace

void vertices_of(const HeightField &height_field, std::span<const std::uint32_t> pixels,
                 const VertexArrays &out, int threads) {
    const Maker maker(height_field, out);
    constexpr std::size_t share = 1 << 14;
    const std::size_t count = pixels.size() / 2;
    for_each_job((count + share - 1) / share, threads, [&](std::size_t job) {
        for (std::size_t k = job * share; k < std::min(count, (job + 1) * share); ++k) {
            maker.make(pixels[2 * k], pixels[2 * k + 1], k);
        }
    });
}

void whole_grid(const HeightField &height_field, const VertexArrays &out, std::uint32_t *triangles,
                int threads) {
    const Maker maker(height_field, out);
    for_each_job(height_field.rows, threads, [&](std::size_t row) {
        for (std::size_t column = 0; column < height_field.columns; ++column) {
            maker.make(row, column, row * height_field.columns + column);
        }
        if (row + 1 == height_field.rows) {
            return;
        }
        std::uint32_t *next = triangles + 6 * row * (height_field.columns - 1);
        auto corner = static_cast<std::uint32_t>(row * height_field.columns);
        for (std::size_t column = 0; column + 1 < height_field.columns; ++column, ++corner, next += 6) {
            const auto below = static_cast<std::uint32_t>(corner + height_field.columns);
            next[0] = corner;
            next[1] = below + 1;
            next[2] = corner + 1;
            next[3] = corner;
            next[4] = below;
            next[5] = below + 1;
        }
    });
}

} // namespace paradize::terrain
