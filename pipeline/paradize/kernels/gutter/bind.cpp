// Python face of the gutter kernels; shapes are checked in kernels/gutter, sizes and indices once more
// here.

#include <algorithm>
#include <array>

#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "gutter/walk.hpp"
#include "math/functions.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

gutter::Layout layout_of(const In<std::uint8_t> &inside, const In<std::int32_t> &source,
                         const In<std::int32_t> &owner, bool repeat) {
    const std::size_t count = inside.size();
    need(inside.ndim() == 2 && count > 0 && count < (std::size_t{1} << 31), "the map is not two-dimensional");
    need(source.size() == count && owner.size() == count, "the map's arrays differ in size");
    const auto texels = static_cast<std::int32_t>(count);
    for (std::size_t i = 0; i < count; ++i) {
        need(source.data()[i] >= 0 && source.data()[i] < texels, "a source is out of range");
        need(owner.data()[i] >= 0, "a texel has no owner");
    }
    return {{inside.data(), count}, {source.data(), count}, {owner.data(), count}, repeat};
}

// Encoded sRGB in 0..1 -> linear light, from a table of 4096 steps, straight between them.
void linear_light(const In<float> &values, const Out<float> &result) {
    need(values.size() == result.size(), "arrays differ in size");
    constexpr std::size_t steps = 4096;
    std::array<float, steps + 2> table{};
    for (std::size_t i = 0; i <= steps; ++i) {
        table[i] = static_cast<float>(mathx::srgb_to_linear(static_cast<double>(i) / steps));
    }
    table[steps + 1] = table[steps];
    const float *from = values.data();
    float *to = result.data();
    nb::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const float at = (from[i] > 0.0F ? std::min(from[i], 1.0F) : 0.0F) * static_cast<float>(steps);
        const auto k = static_cast<std::size_t>(at);
        to[i] = table[k] + (at - static_cast<float>(k)) * (table[k + 1] - table[k]);
    }
}

void touching(const In<std::int32_t> &ids, std::size_t count, bool repeat, const Out<std::int32_t> &names) {
    need(ids.ndim() == 2 && names.size() == count, "arrays differ in size");
    const auto limit = static_cast<std::int64_t>(count);
    need(std::all_of(ids.data(), ids.data() + ids.size(), [&](std::int32_t id) { return id < limit; }),
         "an island is out of range");
    nb::gil_scoped_release unlocked;
    const auto found = gutter::touching(flat(ids), ids.shape(0), ids.shape(1), count, repeat);
    std::copy(found.begin(), found.end(), names.data());
}

nb::tuple smallest_gap(const In<std::uint8_t> &inside, const In<std::int32_t> &source,
                       const In<std::int32_t> &owner, bool repeat) {
    const gutter::Layout layout = layout_of(inside, source, owner, repeat);
    std::array<std::int64_t, 2> pair{};
    double gap = 0.0;
    {
        nb::gil_scoped_release unlocked;
        gap = gutter::smallest_gap(layout, inside.shape(0), inside.shape(1), pair);
    }
    return nb::make_tuple(gap, pair[0], pair[1]);
}

// A layout that is kept, with the texels of its borders.
class Borders {
  public:
    Borders(const In<std::uint8_t> &inside, const In<std::int32_t> &source, const In<std::int32_t> &owner,
            bool repeat) {
        const gutter::Layout given = layout_of(inside, source, owner, repeat);
        rows_ = inside.shape(0);
        columns_ = inside.shape(1);
        nb::gil_scoped_release unlocked;
        inside_.assign(given.inside.begin(), given.inside.end());
        source_.assign(given.source.begin(), given.source.end());
        owner_.assign(given.owner.begin(), given.owner.end());
        layout_ = {inside_, source_, owner_, repeat};
        islands_ = *std::max_element(owner_.begin(), owner_.end()) + std::size_t{1};
        border_ = gutter::border_of(layout_, rows_, columns_);
    }
    Borders(const Borders &) = delete;
    Borders &operator=(const Borders &) = delete;

    // levels: (h, w, channels) each. result: (levels, 9) float64: mean, p99, p99 of all, worst, x, y, island,
    // samples, own.
    void walk(const std::vector<In<float>> &levels, int kind, const In<double> &reach,
              const Out<double> &result, int threads) const {
        need(!levels.empty() && levels[0].ndim() == 3, "the levels are not three-dimensional");
        const std::size_t channels = levels[0].shape(2);
        need(kind >= 0 && kind <= 2, "no such kind");
        need(channels >= 1 && channels <= 4 && (kind != 2 || channels == 2), "a kind with so many channels");
        need(reach.size() >= islands_, "an island is out of range");
        need(std::all_of(reach.data(), reach.data() + reach.size(), [](double r) { return r <= 1e3; }),
             "a reach is out of range");
        need(result.size() == levels.size() * 9, "the result has the wrong size");
        std::vector<const float *> texels;
        std::size_t rows = rows_;
        std::size_t columns = columns_;
        for (const In<float> &level : levels) {
            need(level.ndim() == 3 && level.shape(0) == rows && level.shape(1) == columns &&
                     level.shape(2) == channels,
                 "the chain is not whole");
            texels.push_back(level.data());
            need(texels.size() == levels.size() || rows > 1 || columns > 1, "more levels than there are");
            rows = std::max<std::size_t>(1, rows / 2);
            columns = std::max<std::size_t>(1, columns / 2);
        }
        const gutter::Chain chain{texels, rows_, columns_, channels};
        nb::gil_scoped_release unlocked;
        const auto found =
            gutter::walk(chain, static_cast<gutter::Kind>(kind), layout_, border_, flat(reach), threads);
        double *to = result.data();
        for (const gutter::LevelBleed &level : found) {
            for (const double value :
                 {level.mean, level.p99, level.all_p99, level.worst, static_cast<double>(level.x),
                  static_cast<double>(level.y), static_cast<double>(level.island),
                  static_cast<double>(level.samples), level.own}) {
                *to++ = value;
            }
        }
    }

  private:
    std::vector<std::uint8_t> inside_;
    std::vector<std::int32_t> source_;
    std::vector<std::int32_t> owner_;
    gutter::Layout layout_{};
    std::vector<std::uint32_t> border_;
    std::size_t rows_ = 0;
    std::size_t columns_ = 0;
    std::size_t islands_ = 0;
};

} // namespace

NB_MODULE(_gutter, m) {
    m.doc() = "Gutter kernels: islands that touch, gaps between islands, the walk along their borders.";
    m.def("linear_light", &linear_light);
    m.def("touching", &touching);
    m.def("smallest_gap", &smallest_gap);
    nb::class_<Borders>(m, "Borders")
        .def(nb::init<const In<std::uint8_t> &, const In<std::int32_t> &, const In<std::int32_t> &, bool>())
        .def("walk", &Borders::walk);
}
