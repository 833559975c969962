#include "terrain/delaunay.hpp"
#include "terrain/patch.hpp"
#include "terrain/rtin.hpp"
#include "terrain/vertices.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

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

// An array that is not filled yet; `data` becomes its first element. Large ones ask for large pages: a grid
// of 16 million vertices is mostly the kernel's work of making them.
template <typename Value>
nb::ndarray<nb::numpy, Value> new_array(std::size_t count, std::size_t width, Value *&data) {
    constexpr std::size_t page = std::size_t{1} << 21;
    const std::size_t bytes = std::max<std::size_t>(count * width, 1) * sizeof(Value);
    const std::size_t unit = bytes < page ? 64 : page, whole = (bytes + unit - 1) / unit * unit;
    data = static_cast<Value *>(std::aligned_alloc(unit, whole));
    if (data == nullptr) {
        throw std::bad_alloc();
    }
#ifdef MADV_HUGEPAGE
    if (unit == page) {
        madvise(data, whole, MADV_HUGEPAGE); // a wish: what it answers does not matter
    }
#endif
    nb::capsule owner(data, [](void *p) noexcept { std::free(p); });
    return nb::ndarray<nb::numpy, Value>(data, {count, width}, owner);
}

using Pixels = nb::ndarray<const std::uint32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

// pixels: none for every pixel, with triangles.
nb::tuple vertices(const Heights &heights, const std::optional<Pixels> &pixels, double size_x_m,
                   double size_z_m, double sand_repeat, int threads) {
    const std::size_t rows = heights.shape(0), columns = heights.shape(1);
    if (rows < 2 || columns < 2 || rows * columns > 0xffffffffU)
        throw nb::value_error("heights must be 2 or more on each side, and less than 2^32 in all");
    for (std::size_t k = 0; pixels && k < pixels->shape(0); ++k) {
        if (pixels->data()[2 * k] >= rows || pixels->data()[2 * k + 1] >= columns)
            throw nb::value_error("a vertex is no pixel of the field");
    }
    const paradize::terrain::HeightField height_field{
        {heights.data(), rows * columns}, rows, columns, size_x_m, size_z_m, sand_repeat};
    const std::size_t count = pixels ? pixels->shape(0) : rows * columns;
    paradize::terrain::VertexArrays out{};
    auto positions = new_array(count, 3, out.positions), normals = new_array(count, 3, out.normals),
         tangents = new_array(count, 4, out.tangents), uvs = new_array(count, 2, out.uvs),
         uvs1 = new_array(count, 2, out.uvs1);
    std::uint32_t *indices = nullptr;
    auto triangles = new_array(pixels ? 0 : 2 * (rows - 1) * (columns - 1), 3, indices);
    {
        nb::gil_scoped_release release;
        if (pixels) {
            paradize::terrain::vertices_of(height_field, {pixels->data(), 2 * count}, out, threads);
        } else {
            paradize::terrain::whole_grid(height_field, out, indices, threads);
        }
    }
    return nb::make_tuple(positions, normals, tangents, uvs, uvs1, triangles);
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
    m.def("vertices", &vertices, nb::arg("heights").noconvert(), nb::arg("pixels").noconvert().none(),
          nb::arg("size_x_m"), nb::arg("size_z_m"), nb::arg("sand_repeat"), nb::arg("threads"));
}
