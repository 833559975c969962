#include "terrain_delaunay.hpp"
#include "terrain_patch.hpp"
#include "terrain_rtin.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <utility>
#include <vector>

namespace nb = nanobind;

namespace {

using Heights = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::ndarray<nb::numpy, std::uint32_t> to_numpy(std::vector<std::uint32_t> &&values) {
    auto *kept = new std::vector<std::uint32_t>(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<std::vector<std::uint32_t> *>(p); });
    return nb::ndarray<nb::numpy, std::uint32_t>(kept->data(), {kept->size()}, owner);
}

using Maker = paradize::terrain::Triangulation (*)(std::span<const float>, std::uint32_t, std::uint32_t,
                                                   double, int);

template <Maker make>
nb::tuple triangulate(const Heights &heights, double tolerance, int threads) {
    const std::size_t rows = heights.shape(0), columns = heights.shape(1);
    if (rows < 2 || columns < 2 || rows > 16385 || columns > 16385)
        throw nb::value_error("heights must be 2 to 16385 on each side");
    if (!(tolerance >= 0.0))
        throw nb::value_error("tolerance must not be negative");
    paradize::terrain::Triangulation result;
    {
        nb::gil_scoped_release release;
        result = make({heights.data(), rows * columns}, static_cast<std::uint32_t>(columns),
                      static_cast<std::uint32_t>(rows), tolerance, threads);
    }
    return nb::make_tuple(to_numpy(std::move(result.pixels)), to_numpy(std::move(result.triangles)));
}

nb::tuple patch(const Heights &heights, const std::array<std::array<std::int32_t, 2>, 3> &corners,
                double inside, double hypotenuse, double leg, std::size_t most) {
    const std::size_t rows = heights.shape(0), columns = heights.shape(1);
    if (rows < 2 || columns < 2 || rows > 16385 || columns > 16385)
        throw nb::value_error("heights must be 2 to 16385 on each side");
    if (!(inside >= 0.0 && hypotenuse >= 0.0 && leg >= 0.0))
        throw nb::value_error("tolerances must not be negative");
    std::array<paradize::terrain::Point, 3> points{};
    for (std::size_t k = 0; k < 3; ++k) {
        points[k] = {corners[k][1], corners[k][0]};
        if (std::abs(std::int64_t{points[k].x}) > 1 << 20 || std::abs(std::int64_t{points[k].y}) > 1 << 20)
            throw nb::value_error("a corner is more than 2^20 pixels away");
    }
    if (!paradize::terrain::is_patch(points))
        throw nb::value_error("corners must be a right angle and the ends of two legs of one length, along "
                              "rows and columns or along diagonals");
    paradize::terrain::Triangulation result;
    {
        nb::gil_scoped_release release;
        result = paradize::terrain::patch(
            {heights.data(), rows * columns}, static_cast<std::uint32_t>(columns),
            static_cast<std::uint32_t>(rows), points, {inside, hypotenuse, leg}, most);
    }
    return nb::make_tuple(to_numpy(std::move(result.pixels)), to_numpy(std::move(result.triangles)));
}

} // namespace

NB_MODULE(_terrain, m) {
    m.doc() = "Terrain kernels; the checked face is paradize.kernels.terrain.";
    m.def("refine", &triangulate<&paradize::terrain::refine>, nb::arg("heights").noconvert(),
          nb::arg("tolerance"), nb::arg("threads"));
    m.def("bisect", &triangulate<&paradize::terrain::bisect>, nb::arg("heights").noconvert(),
          nb::arg("tolerance"), nb::arg("threads"));
    m.def("patch", &patch, nb::arg("heights").noconvert(), nb::arg("corners"), nb::arg("inside"),
          nb::arg("hypotenuse"), nb::arg("leg"), nb::arg("most"));
}
