// Python face of the atlas kernels; kernels/atlas checks what goes in.

#include <algorithm>
#include <cstdint>

#include "atlas/charts.hpp"
#include "atlas/pack.hpp"
#include "bind.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

using Names = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

nb::tuple make_charts(Rows<double> positions, Rows<std::uint32_t> triangles, double deviation,
                      std::int32_t most, int threads) {
    atlas::Charts found;
    {
        nb::gil_scoped_release unlocked;
        found = atlas::make_charts({flat(positions), flat(triangles)}, deviation, most, threads);
    }
    return nb::make_tuple(give(std::move(found.chart)), give(std::move(found.corners)), found.count);
}

nb::tuple pack(Rows<double> corners, Names chart, std::int32_t count, std::uint32_t resolution,
               std::uint32_t padding) {
    atlas::Packed found;
    {
        nb::gil_scoped_release unlocked;
        found = atlas::pack(flat(corners), flat(chart), count, resolution, padding);
    }
    return nb::make_tuple(give(std::move(found.corners)), found.texels_per_unit);
}

} // namespace

NB_MODULE(_atlas, m) {
    m.doc() = "Atlas kernels: charts, their layout in the plane, their packing.";
    m.def("make_charts", &make_charts);
    m.def("most_charts", &atlas::most_charts);
    m.def("pack", &pack);
}
