// Python face of the simplifier; shapes are checked in kernels/simplify, sizes and indices once more here.

#include <algorithm>
#include <utility>

#include "bind.hpp"
#include "simplify/collapse.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

bool below(std::span<const std::uint32_t> numbers, std::size_t limit) {
    return std::all_of(numbers.begin(), numbers.end(), [&](std::uint32_t number) { return number < limit; });
}

nb::tuple simplify_mesh(const In<double> &positions, const In<std::uint32_t> &triangles,
                        const In<float> &attributes, const In<float> &weights, std::ptrdiff_t unit,
                        const In<std::uint32_t> &place, const In<std::uint32_t> &group, std::size_t target,
                        double kept_area) {
    const std::size_t count = place.size();
    const std::size_t width = weights.size();
    need(positions.size() == 3 * count && attributes.size() == count * width, "vertices differ in number");
    need(triangles.size() == 3 * group.size() && triangles.size() < (std::size_t{1} << 31),
         "triangles and groups differ in number, or are too many");
    need(below(flat(triangles), count) && below(flat(place), count), "a vertex is out of range");
    need(unit == -1 || (unit >= 0 && static_cast<std::size_t>(unit) + 3 <= width), "no such unit vectors");
    simplify::Result result;
    {
        nb::gil_scoped_release unlocked;
        result = simplify::simplify({flat(positions), flat(triangles), flat(attributes), flat(weights), unit,
                                     flat(place), flat(group)},
                                    {target, kept_area});
    }
    return nb::make_tuple(give(std::move(result.positions), 3), give(std::move(result.triangles), 3),
                          give(std::move(result.attributes), std::max<std::size_t>(width, 1)),
                          give(std::move(result.vertex)), give(std::move(result.place)),
                          give(std::move(result.triangle)), static_cast<int>(result.stop));
}

} // namespace

NB_MODULE(_simplify, m) {
    m.doc() = "Simplification of triangle meshes by collapsing edges.";
    m.def("simplify", &simplify_mesh);
}
