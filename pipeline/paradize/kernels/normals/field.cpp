#include "normals/field.hpp"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "normals/islands.hpp"
#include "normals/store.hpp"
#include "parallel.hpp"

namespace paradize::normals {
namespace {

// Rows of an array of heights.
class HeightRows final : public Source {
  public:
    HeightRows(const float *heights, std::size_t columns, const Kernels &kernels)
        : heights_(heights), columns_(columns), kernels_(kernels) {}

    void read(std::size_t y, float *to) override {
        if (!kernels_.copy(heights_ + y * columns_, columns_, to)) {
            throw NotFinite{};
        }
    }

  private:
    const float *heights_;
    std::size_t columns_;
    const Kernels &kernels_;
};

// One row of slopes in double.
void steep_slopes(const float *dx, const float *dy, std::size_t n, double left, double down, float *xyz) {
    if (!all_finite(dx, n) || !all_finite(dy, n)) {
        throw NotFinite{};
    }
    for (std::size_t i = 0; i < n; ++i) {
        const double nx = left * dx[i];
        const double ny = down * dy[i];
        steep_normals(&nx, &ny, 1, xyz + 3 * i);
    }
}

} // namespace

const Kernels &need_kernels(Width width) {
    const Kernels *found = kernels_of(width);
    if (found == nullptr) {
        throw std::invalid_argument("this CPU lacks the instruction set asked for");
    }
    return *found;
}

void normals_from_heights(std::span<const float> heights, std::size_t rows, std::size_t columns,
                          std::span<const std::int32_t> islands, const Settings &settings, std::size_t first,
                          std::size_t last, std::span<float> out, int threads, Width width) {
    const Kernels &kernels = need_kernels(width);
    for_rows(last - first, threads, [&](std::size_t from, std::size_t to) {
        HeightRows source(heights.data(), columns, kernels);
        Sweep sweep(source, rows, columns, settings, kernels);
        RowStore store(columns, out.size(), kernels);
        std::unique_ptr<IslandRows> patches;
        if (!islands.empty()) {
            patches = std::make_unique<IslandRows>(heights, islands, rows, columns, settings);
        }
        for (std::size_t i = from; i < to; ++i) {
            sweep.row(first + i, store.row());
            if (patches) {
                patches->patch(first + i, store.row());
            }
            store.flush(out.data() + 3 * i * columns);
        }
    });
}

void normals_from_slopes(std::span<const float> dx, std::span<const float> dy, std::size_t rows,
                         std::size_t columns, double scale_x, double scale_y, bool green_down,
                         std::span<float> out, int threads, Width width) {
    const Kernels &kernels = need_kernels(width);
    const double down = green_down ? -scale_y : scale_y;
    const bool steep = !fits_float(scale_x) || !fits_float(scale_y);
    for_rows(rows, threads, [&](std::size_t from, std::size_t to) {
        RowStore store(columns, out.size(), kernels);
        std::vector<float> x(columns + margin);
        std::vector<float> y(columns + margin);
        for (std::size_t i = from; i < to; ++i) {
            std::copy_n(&dx[i * columns], columns, x.data());
            std::copy_n(&dy[i * columns], columns, y.data());
            if (steep || !kernels.from_slopes(x.data(), y.data(), columns, static_cast<float>(-scale_x),
                                              static_cast<float>(down), store.row())) {
                steep_slopes(x.data(), y.data(), columns, -scale_x, down, store.row());
            }
            store.flush(out.data() + 3 * i * columns);
        }
    });
}

} // namespace paradize::normals
