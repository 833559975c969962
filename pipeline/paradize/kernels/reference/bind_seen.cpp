// Python face of the reference kernel that compares pictures of meshes. kernels/reference/seen.py checks what
// goes in.
#include "reference/bind_seen.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "reference/flip.hpp"
#include "reference/seen.hpp"
#include "reference/switch.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

using Texels = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// The arrays of all of these are held by the caller.
std::vector<reference::Mip> chain(const std::vector<Texels> &levels) {
    std::vector<reference::Mip> out;
    for (const Texels &level : levels) {
        out.push_back({flat(level), level.shape(0), level.shape(1)});
    }
    return out;
}

reference::SeenMaterial material(const std::vector<Texels> &normals, const std::vector<Texels> &alpha,
                                 const std::vector<Texels> &colors, const std::vector<Texels> &glow,
                                 double cutoff, unsigned across, unsigned down, bool two_sided) {
    return {chain(normals),
            chain(alpha),
            chain(colors),
            chain(glow),
            cutoff,
            static_cast<reference::Wrap>(across),
            static_cast<reference::Wrap>(down),
            two_sided};
}

template <typename T>
std::span<const T> rows_or_none(const nb::object &rows) {
    if (rows.is_none()) {
        return {};
    }
    return flat(nb::cast<Rows<T>>(rows));
}

reference::SeenMesh mesh(Rows<float> positions, Rows<std::uint32_t> triangles, const nb::object &normals,
                         const nb::object &tangents, const nb::object &uvs, Column<std::uint32_t> by_triangle,
                         std::vector<reference::SeenMaterial> materials, const nb::object &colors) {
    return {{flat(positions), flat(triangles)},
            {flat(triangles), rows_or_none<float>(normals), rows_or_none<float>(tangents),
             rows_or_none<float>(uvs)},
            flat(by_triangle),
            std::move(materials),
            rows_or_none<float>(colors)};
}

nb::list seen_differences(const reference::SeenMesh &a, const reference::SeenMesh &b, Rows<double> directions,
                          double pixel, std::size_t samples, std::size_t most_tiles, double p99,
                          double changed, int threads) {
    std::vector<reference::SeenDifference> found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::seen_differences(a, b, flat(directions), pixel, samples, most_tiles,
                                            {p99, changed}, threads);
    }
    nb::list out;
    for (const reference::SeenDifference &one : found) {
        out.append(nb::make_tuple(one.mean, one.p99, one.max, one.covered, one.changed, one.box));
    }
    return out;
}

nb::object switch_flips(const reference::SeenMesh &before, const reference::SeenMesh &after,
                        Rows<double> directions, double pixel, std::size_t samples, unsigned background,
                        std::array<double, 3> to_light, double direct, double around, int threads) {
    std::vector<double> found;
    {
        nb::gil_scoped_release unlocked;
        const reference::SwitchPictures how{
            {to_light, direct, around}, static_cast<std::uint8_t>(background), samples};
        found = reference::switch_flips(before, after, flat(directions), pixel, how, threads);
    }
    return give(std::move(found));
}

using Codes = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

nb::object flip(const Codes &a, const Codes &b) {
    std::vector<float> found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::flip(flat(a), flat(b), a.shape(0), a.shape(1));
    }
    return give(std::move(found), a.shape(1));
}

} // namespace

void bind_reference_seen(nb::module_ &m) {
    nb::class_<reference::SeenMaterial>(m, "SeenMaterial");
    m.def("seen_material", &material);
    nb::class_<reference::SeenMesh>(m, "SeenMesh");
    m.def("seen_mesh", &mesh, nb::arg("positions"), nb::arg("triangles"), nb::arg("normals").none(),
          nb::arg("tangents").none(), nb::arg("uvs").none(), nb::arg("by_triangle"), nb::arg("materials"),
          nb::arg("colors").none());
    m.def("seen_differences", &seen_differences);
    m.def("switch_flips", &switch_flips);
    m.def("flip", &flip);
}
