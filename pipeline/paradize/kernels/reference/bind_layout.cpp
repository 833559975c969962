// Python face of the reference kernels that measure orders of triangles and UV layouts.
// kernels/reference/draw.py and kernels/reference/atlas.py check what goes in.
#include "reference/bind_layout.hpp"

#include <nanobind/stl/vector.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "reference/atlas.hpp"
#include "reference/draw.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

nb::tuple draw_cost(Rows<std::uint32_t> triangles, std::size_t vertices, unsigned cache,
                    const std::vector<std::uint32_t> &strides, std::uint64_t lines) {
    reference::DrawCost found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::draw_cost(flat(triangles), vertices, cache, strides, lines);
    }
    return nb::make_tuple(found.acmr, found.atvr, found.overfetch);
}

using Names = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

nb::dict layout_quality(Rows<double> positions, Rows<std::uint32_t> triangles, Rows<double> corners) {
    reference::LayoutQuality found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::layout_quality({flat(positions), flat(triangles), flat(corners)});
    }
    nb::dict out;
    out["stretch"] = found.stretch;
    out["seam_length"] = found.seam_length;
    out["packing"] = found.packing;
    out["flipped"] = found.flipped;
    out["without"] = found.without;
    out["charts"] = found.charts;
    auto *density = new std::vector<double>(std::move(found.density));
    nb::capsule owner(density, [](void *p) noexcept { delete static_cast<std::vector<double> *>(p); });
    out["density"] = nb::ndarray<nb::numpy, double>(density->data(), {density->size()}, owner);
    return out;
}

nb::tuple layout_raster(Rows<double> positions, Rows<std::uint32_t> triangles, Rows<double> corners,
                        std::uint32_t resolution, std::uint32_t gap) {
    reference::LayoutRaster found;
    {
        nb::gil_scoped_release unlocked;
        const auto chart = reference::charts_of({flat(positions), flat(triangles), flat(corners)});
        found = reference::layout_raster(flat(corners), chart, resolution, gap);
    }
    return nb::make_tuple(found.covered, found.twice, found.near);
}

} // namespace

void bind_reference_layout(nb::module_ &m) {
    m.def("draw_cost", &draw_cost);
    m.def("layout_quality", &layout_quality);
    m.def("layout_raster", &layout_raster);
}
