// Python face of OpenMesh; shapes and values are checked in kernels/openmesh, indices once more here.

#include <algorithm>

#include "bind.hpp"
#include "openmesh/surface.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

void need_mesh(const Rows<double> &positions, const Rows<std::uint32_t> &triangles) {
    need(positions.shape(1) == 3 && triangles.shape(1) == 3, "arrays have three columns");
    need(positions.shape(0) < (std::size_t{1} << 29) && triangles.shape(0) < (std::size_t{1} << 29),
         "the mesh is too large for OpenMesh");
    const std::uint32_t *corner = triangles.data();
    for (std::size_t i = 0; i < triangles.size(); i += 3, corner += 3) {
        need(std::max({corner[0], corner[1], corner[2]}) < positions.shape(0), "an index is out of range");
        need(corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0],
             "a triangle repeats an index");
    }
}

nb::tuple count(const Rows<double> &positions, const Rows<std::uint32_t> &triangles) {
    need_mesh(positions, triangles);
    openmesh::Counts found;
    {
        nb::gil_scoped_release unlocked;
        found = openmesh::count(flat(positions), flat(triangles));
    }
    return nb::make_tuple(found.faces, found.edges, found.border);
}

nb::tuple simplify(const Rows<double> &positions, const Rows<std::uint32_t> &triangles, std::size_t target) {
    need_mesh(positions, triangles);
    openmesh::Simplified found;
    {
        nb::gil_scoped_release unlocked;
        found = openmesh::simplify(flat(positions), flat(triangles), target);
    }
    return nb::make_tuple(give(std::move(found.vertex)), give(std::move(found.triangles), 3));
}

} // namespace

NB_MODULE(_openmesh, m) {
    m.doc() = "OpenMesh: a second count of a surface's edges, and its simplifier.";
    m.attr("VERSION") = PARADIZE_OPENMESH_VERSION;
    m.def("count", &count);
    m.def("simplify", &simplify);
}
