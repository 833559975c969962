// Python face of the mesh kernels. kernels/mesh checks shapes, ranges and finiteness before it calls
// these.

#include <memory>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "mesh/buffer.hpp"
#include "mesh/normals.hpp"
#include "mesh/project.hpp"
#include "mesh/reach.hpp"
#include "mesh/tangents/tangents.hpp"
#include "mesh/topology.hpp"
#include "mesh/weld.hpp"
#include "unify.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

mesh::Surface surface_of(const Rows<float> &positions, const Rows<float> &normals, const Rows<float> &uvs,
                         const Rows<std::uint32_t> &triangles) {
    return {flat(positions), flat(normals), flat(uvs), flat(triangles)};
}

nb::tuple split_tangents(Rows<float> positions, Rows<float> normals, Rows<float> uvs,
                         Rows<std::uint32_t> triangles, int method, int threads) {
    mesh::SplitTangents split;
    {
        nb::gil_scoped_release unlocked;
        split = mesh::split_tangents(surface_of(positions, normals, uvs, triangles),
                                     static_cast<mesh::Method>(method), threads);
    }
    static_assert(sizeof(mesh::Frame) == 4 * sizeof(float));
    auto *const frames = new std::vector<mesh::Frame>(std::move(split.frames));
    nb::capsule owner(frames, [](void *p) noexcept { delete static_cast<std::vector<mesh::Frame> *>(p); });
    auto *const values = reinterpret_cast<float *>(frames->data());
    return nb::make_tuple(give(std::move(split.index)), give(std::move(split.source)),
                          nb::ndarray<nb::numpy, float>(values, {frames->size(), 4}, owner));
}

nb::object corner_normals(Rows<float> positions, Column<std::uint32_t> places, Rows<std::uint32_t> triangles,
                          Column<std::uint32_t> smoothing, double crease_deg) {
    std::vector<float> out(triangles.size() * 3);
    {
        nb::gil_scoped_release unlocked;
        mesh::corner_normals(flat(positions), flat(places), flat(triangles), flat(smoothing), crease_deg,
                             out);
    }
    return give(std::move(out), 3);
}

nb::tuple rows_by_value(Rows<float> rows) {
    Numbered numbered;
    {
        nb::gil_scoped_release unlocked;
        numbered = paradize::number_rows(flat(rows), rows.shape(1));
    }
    return nb::make_tuple(give(std::move(numbered.index)), give(std::move(numbered.first)));
}

nb::tuple corners_by_value(Column<std::uint32_t> base, Rows<float> rows) {
    Numbered numbered;
    {
        nb::gil_scoped_release unlocked;
        const auto keys = flat(base);
        const auto values = flat(rows);
        const std::size_t width = rows.shape(1);
        numbered = number_equal(
            keys.size(),
            [&](std::size_t i) {
                std::uint64_t h = mix(hash_seed, keys[i]);
                for (std::size_t k = 0; k < width; ++k)
                    h = mix(h, float_key(values[i * width + k]));
                return h;
            },
            [&](std::size_t a, std::size_t b) {
                if (keys[a] != keys[b])
                    return false;
                for (std::size_t k = 0; k < width; ++k)
                    if (values[a * width + k] != values[b * width + k])
                        return false;
                return true;
            });
    }
    return nb::make_tuple(give(std::move(numbered.index)), give(std::move(numbered.first)));
}

nb::dict topology(Rows<std::uint32_t> triangles, std::uint32_t vertices) {
    mesh::Topology found;
    {
        nb::gil_scoped_release unlocked;
        found = mesh::topology(flat(triangles), vertices);
    }
    const auto as_tuple = [](const mesh::Occurrences &kind) {
        return nb::make_tuple(kind.count, kind.first_triangle);
    };
    nb::dict out;
    out["edges"] = found.edges;
    out["border"] = as_tuple(found.border);
    out["non_manifold"] = as_tuple(found.non_manifold);
    out["turned"] = as_tuple(found.turned);
    out["bow_tie"] = as_tuple(found.bow_tie);
    out["components"] = found.components;
    out["component"] = give(std::move(found.component));
    out["island"] = give(std::move(found.island));
    return out;
}

nb::object weld(Rows<float> points, double tolerance) {
    std::vector<std::uint32_t> target;
    {
        nb::gil_scoped_release unlocked;
        target = mesh::weld(flat(points), tolerance);
    }
    return give(std::move(target));
}

nb::tuple project(Rows<float> source_positions, Rows<std::uint32_t> source_triangles,
                  Column<std::uint32_t> charts, Rows<float> positions, Rows<std::uint32_t> triangles,
                  bool one_chart) {
    mesh::Places places;
    {
        nb::gil_scoped_release unlocked;
        places = mesh::project(flat(source_positions), flat(source_triangles), flat(charts), flat(positions),
                               flat(triangles), one_chart);
    }
    return nb::make_tuple(give(std::move(places.triangle)), give(std::move(places.weights), 3));
}

nb::tuple reach(Rows<float> places, Rows<std::uint32_t> triangles, double rooted) {
    mesh::RootDistances found;
    {
        nb::gil_scoped_release unlocked;
        found = mesh::reach(flat(places), flat(triangles), rooted);
    }
    return nb::make_tuple(give(std::move(found.from_root)), give(std::move(found.in_branch)));
}

} // namespace

NB_MODULE(_mesh, m) {
    m.doc() = "Mesh kernels: tangent frames, normals, topology.";
    m.def("split_tangents", &split_tangents);
    m.def("corner_normals", &corner_normals);
    m.def("number_rows", &rows_by_value);
    m.def("number_corners", &corners_by_value);
    m.def("topology", &topology);
    m.def("weld", &weld);
    m.def("project", &project);
    m.def("reach", &reach);
}
