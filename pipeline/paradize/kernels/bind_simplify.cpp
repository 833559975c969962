// Python face of the simplifier; shapes are checked in kernels/simplify.py, sizes and indices once more here.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "simplify_collapse.hpp"

namespace nb = nanobind;
using namespace paradize;

namespace {

template <typename T>
using In = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;

void need(bool condition, const char *what) {
    if (!condition) {
        throw std::invalid_argument(what);
    }
}

template <typename T>
std::span<const T> flat(const In<T> &array) {
    return {array.data(), array.size()};
}

bool below(std::span<const std::uint32_t> numbers, std::size_t limit) {
    return std::all_of(numbers.begin(), numbers.end(), [&](std::uint32_t number) { return number < limit; });
}

// A numpy array that owns the vector's numbers; columns 0 for one dimension.
template <typename T>
nb::ndarray<nb::numpy, T> give(std::vector<T> &&values, std::size_t columns) {
    auto *kept = new std::vector<T>(std::move(values));
    const nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<std::vector<T> *>(p); });
    const std::size_t rows = columns == 0 ? kept->size() : kept->size() / columns;
    const std::size_t shape[2] = {rows, columns};
    return nb::ndarray<nb::numpy, T>(kept->data(), columns == 0 ? 1 : 2, shape, owner);
}

nb::tuple collapse(const In<double> &positions, const In<std::uint32_t> &triangles,
                   const In<float> &attributes, const In<float> &weights, std::ptrdiff_t unit,
                   const In<std::uint32_t> &place, const In<std::uint32_t> &group,
                   const In<std::uint8_t> &locked, std::size_t target, double max_error, double kept_area) {
    const std::size_t count = place.size();
    const std::size_t width = weights.size();
    need(positions.size() == 3 * count && locked.size() == count && attributes.size() == count * width,
         "vertices differ in number");
    need(triangles.size() == 3 * group.size() && triangles.size() < (std::size_t{1} << 31),
         "triangles and groups differ in number, or are too many");
    need(below(flat(triangles), count) && below(flat(place), count), "a vertex is out of range");
    need(unit == -1 || (unit >= 0 && static_cast<std::size_t>(unit) + 3 <= width), "no such unit vectors");
    simplify::Result result;
    {
        nb::gil_scoped_release unlocked;
        result = simplify::simplify({flat(positions), flat(triangles), flat(attributes), flat(weights), unit,
                                     flat(place), flat(group), flat(locked)},
                                    {target, max_error, kept_area});
    }
    return nb::make_tuple(give(std::move(result.positions), 3), give(std::move(result.triangles), 3),
                          give(std::move(result.attributes), std::max<std::size_t>(width, 1)),
                          give(std::move(result.vertex), 0), give(std::move(result.place), 0),
                          give(std::move(result.triangle), 0), result.error, static_cast<int>(result.stop));
}

} // namespace

NB_MODULE(_simplify, m) {
    m.doc() = "Simplification of triangle meshes by collapsing edges.";
    m.def("collapse", &collapse);
}
