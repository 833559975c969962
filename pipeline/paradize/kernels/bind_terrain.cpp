#include "terrain_delaunay.hpp"
#include "terrain_rtin.hpp"

#include <cstdint>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
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

} // namespace

NB_MODULE(_terrain, m) {
    m.doc() = "Terrain kernels; the checked face is paradize.kernels.terrain.";
    m.def("refine", &triangulate<&paradize::terrain::refine>, nb::arg("heights").noconvert(),
          nb::arg("tolerance"), nb::arg("threads"));
    m.def("bisect", &triangulate<&paradize::terrain::bisect>, nb::arg("heights").noconvert(),
          nb::arg("tolerance"), nb::arg("threads"));
}
