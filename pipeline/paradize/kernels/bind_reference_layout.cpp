// Python face of the reference kernels that judge orders of triangles. kernels/reference_draw.py checks what
// goes in.
#include "bind_reference_layout.hpp"

#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <vector>

#include "reference_draw.hpp"

namespace nb = nanobind;
using namespace paradize;

namespace {

template <typename T>
using Rows = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::tuple draw_cost(Rows<std::uint32_t> triangles, std::size_t vertices, unsigned cache,
                    const std::vector<std::uint32_t> &strides, std::uint64_t lines) {
    reference::DrawCost found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::draw_cost({triangles.data(), triangles.size()}, vertices, cache, strides, lines);
    }
    return nb::make_tuple(found.acmr, found.atvr, found.overfetch);
}

double overdraw(Rows<float> positions, Rows<std::uint32_t> triangles, unsigned side) {
    nb::gil_scoped_release unlocked;
    return reference::overdraw({positions.data(), positions.size()}, {triangles.data(), triangles.size()},
                               side);
}

} // namespace

void bind_reference_layout(nb::module_ &m) {
    m.def("draw_cost", &draw_cost);
    m.def("overdraw", &overdraw);
}
