#include "normals/material.hpp"

#include <algorithm>
#include <mutex>
#include <vector>

#include "normals/balance.hpp"
#include "normals/field.hpp"
#include "normals/levels.hpp"
#include "normals/store.hpp"
#include "normals/sweep.hpp"
#include "parallel.hpp"

namespace paradize::normals {
namespace {

// Heights of a colour picture. On the way down it writes the codes of height and gloss of its own rows.
class ColorRows final : public Source {
  public:
    ColorRows(const Luminance &luminance, const MaterialSettings &settings, const ColorView &color,
              const MaterialOut &out, std::size_t first, std::size_t last, const Kernels &kernels)
        : luminance_(luminance), settings_(settings), columns_(color.columns), out_(out), first_(first),
          last_(last), kernels_(kernels), height_levels_(settings.height, luminance, kernels),
          gloss_levels_(settings.gloss, luminance, kernels), light_(columns_ + margin),
          shine_(columns_ + margin), height_store_(2 * columns_, out.height.size_bytes(), kernels),
          gloss_store_(2 * columns_, out.gloss.size(), kernels) {}

    void read(std::size_t y, float *to) override {
        if (height_levels_.neutral()) {
            luminance_.row(y, to);
            light_here_ = to;
            return;
        }
        luminance_.row(y, light_.data());
        height_levels_.apply(light_.data(), columns_, to);
        light_here_ = light_.data();
    }

    void read_own(std::size_t y, float *to) override {
        read(y, to);
        if (y < first_ || y >= last_) {
            return;
        }
        kernels_.height_codes(to, columns_, height_store_.row());
        height_store_.flush(reinterpret_cast<std::uint8_t *>(out_.height.data() + y * columns_));
        const float *shine = light_here_;
        if (!gloss_levels_.neutral()) {
            gloss_levels_.apply(light_here_, columns_, shine_.data());
            shine = shine_.data();
        }
        const float low[2] = {settings_.specular_low, settings_.smoothness_low};
        const float step[2] = {settings_.specular_step, settings_.smoothness_step};
        kernels_.gloss_codes(shine, columns_, low, step, gloss_store_.row());
        gloss_store_.flush(out_.gloss.data() + 2 * y * columns_);
    }

  private:
    const Luminance &luminance_;
    const MaterialSettings &settings_;
    std::size_t columns_;
    const MaterialOut &out_;
    std::size_t first_;
    std::size_t last_;
    const Kernels &kernels_;
    LevelRow height_levels_;
    LevelRow gloss_levels_;
    std::vector<float> light_;
    const float *light_here_ = nullptr; // the luminance of the row read last
    std::vector<float> shine_;
    RowStore height_store_;
    RowStore gloss_store_;
};

// Du/dv from what the first sweep left in `normal` and `dudv`.
void finish_dudv(const FineCounts &counts, const ColorView &color, const MaterialOut &out, int threads,
                 const Kernels &kernels) {
    const std::size_t columns = color.columns;
    const Shift shifts[2] = {balance(counts, columns, 0), balance(counts, columns, 1)};
    auto *dudv = reinterpret_cast<std::uint8_t *>(out.dudv.data());
    if (shifts[0].cut_off || shifts[1].cut_off) {
        balance_cut_off(out.normal.data(), dudv, color.rows * columns, 0);
        balance_cut_off(out.normal.data(), dudv, color.rows * columns, 1);
        return;
    }
    for_rows(color.rows, threads, [&](std::size_t from, std::size_t to) {
        std::vector<std::uint8_t> normal(3 * columns + slack);
        std::vector<std::uint8_t> rest(2 * columns + slack);
        const std::int32_t by[2] = {shifts[0].by, shifts[1].by};
        for (std::size_t y = from; y < to; ++y) {
            std::copy_n(out.normal.data() + 3 * y * columns, 3 * columns, normal.data());
            std::copy_n(dudv + 2 * y * columns, 2 * columns, rest.data());
            std::uint32_t more[2] = {shifts[0].more[y], shifts[1].more[y]};
            kernels.shifted_codes(normal.data(), rest.data(), columns, by, more, rest.data());
            std::copy_n(rest.data(), 2 * columns, dudv + 2 * y * columns);
        }
    });
}

} // namespace

void material_maps(const ColorView &color, const MaterialSettings &settings, const MaterialOut &out,
                   int threads, Width width) {
    const Kernels &kernels = need_kernels(width);
    const std::size_t columns = color.columns;
    const Luminance luminance(color, settings.encoded, width == Width::widest);
    FineCounts counts;
    counts.levels.resize(2 * levels * color.rows);
    std::mutex adding;
    for_rows(color.rows, threads, [&](std::size_t from, std::size_t to) {
        ColorRows source(luminance, settings, color, out, from, to, kernels);
        Sweep sweep(source, color.rows, columns, settings.normal, kernels);
        RowStore normal(3 * columns, out.normal.size(), kernels);
        RowStore rest(2 * columns, out.dudv.size(), kernels);
        FineSums sums;
        for (std::size_t y = from; y < to; ++y) {
            sweep.row(y, Encoding::fine, {normal.row(), rest.row(), &sums});
            normal.flush(out.normal.data() + 3 * y * columns);
            kernels.count_levels(rest.row(), columns, &counts.levels[2 * levels * y]);
            rest.flush(reinterpret_cast<std::uint8_t *>(out.dudv.data()) + 2 * y * columns);
        }
        const std::lock_guard<std::mutex> alone(adding);
        counts.sums.add(sums);
    });
    finish_dudv(counts, color, out, threads, kernels);
}

} // namespace paradize::normals
