// Python face of the atlas kernels; kernels/atlas.py checks what goes in.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "atlas_charts.hpp"
#include "atlas_pack.hpp"

namespace nb = nanobind;
using namespace paradize;

namespace {

template <typename T>
using Rows = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Names = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <typename T>
nb::object array(std::vector<T> &&values) {
    auto *kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<std::vector<T> *>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), {kept->size()}, owner));
}

nb::tuple make_charts(Rows<double> positions, Rows<std::uint32_t> triangles, double deviation, int threads) {
    atlas::Charts found;
    {
        nb::gil_scoped_release unlocked;
        found = atlas::make_charts(
            {{positions.data(), positions.size()}, {triangles.data(), triangles.size()}}, deviation, threads);
    }
    return nb::make_tuple(array(std::move(found.chart)), array(std::move(found.corners)), found.count);
}

nb::tuple pack(Rows<double> corners, Names chart, std::int32_t count, std::uint32_t resolution,
               std::uint32_t padding) {
    atlas::Packed found;
    {
        nb::gil_scoped_release unlocked;
        found = atlas::pack({corners.data(), corners.size()}, {chart.data(), chart.size()}, count, resolution,
                            padding);
    }
    return nb::make_tuple(array(std::move(found.corners)), found.texels_per_unit);
}

} // namespace

NB_MODULE(_atlas, m) {
    m.doc() = "Atlas kernels: charts, their layout in the plane, their packing.";
    m.def("make_charts", &make_charts);
    m.def("pack", &pack);
}
