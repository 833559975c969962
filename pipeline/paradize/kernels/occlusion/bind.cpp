// Python face of the occlusion kernels; kernels/occlusion checks ranges and finiteness before it calls these.
#include "bind.hpp"
#include "occlusion/cast.hpp"
#include "occlusion/texels.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

struct Scene {
    Scene(Rows<float> positions, Rows<std::uint32_t> triangles, std::size_t rays)
        : tree(occlusion::build_tree(flat(positions), flat(triangles))),
          directions(occlusion::make_directions(rays)) {}
    occlusion::Tree tree;
    occlusion::Directions directions;
};

void cast(const Scene &scene, Rows<float> points, Rows<float> normals, Rows<float> faces,
          Column<std::uint32_t> texels, std::size_t columns, float reach, const Out<float> &result,
          int threads, int width) {
    const std::size_t count = texels.size();
    need(points.size() == 3 * count && normals.size() == 3 * count && faces.size() == 3 * count,
         "points, normals, faces and texels differ in number");
    need(columns > 0, "a map without columns");
    need(occlusion::has_width(width), "no such instruction set");
    const auto to = out(result, count);
    nb::gil_scoped_release unlocked;
    occlusion::cast_all(scene.tree, flat(points), flat(normals), flat(faces), flat(texels), columns,
                        scene.directions, reach, to, threads, width);
}

nb::tuple places(Rows<float> uvs, Rows<std::uint32_t> triangles, Rows<std::int32_t> touched,
                 std::size_t most) {
    occlusion::Places found;
    {
        nb::gil_scoped_release unlocked;
        found = occlusion::places_of(flat(uvs), flat(triangles), flat(touched), touched.shape(0),
                                     touched.shape(1), most);
    }
    const std::size_t shared = found.shared;
    return nb::make_tuple(give(std::move(found.texel)), give(std::move(found.triangle)),
                          give(std::move(found.weights), 3), shared);
}

} // namespace

NB_MODULE(_occlusion, m) {
    m.doc() = "Occlusion kernels: the places that texels show, and rays from them.";
    nb::class_<Scene>(m, "Scene").def(nb::init<Rows<float>, Rows<std::uint32_t>, std::size_t>());
    m.def("has_width", &occlusion::has_width);
    m.def("cast", &cast);
    m.def("places", &places);
}
