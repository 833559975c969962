// Python face of the reference kernels that metrics measure with. kernels/reference and
// kernels/reference/maps check what goes in.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <span>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "math/functions.hpp"
#include "reference/bind_layout.hpp"
#include "reference/bind_seen.hpp"
#include "reference/bound.hpp"
#include "reference/distance.hpp"
#include "reference/frames.hpp"
#include "reference/loading.hpp"
#include "reference/maps/maps.hpp"
#include "reference/occlusion.hpp"
#include "reference/places.hpp"
#include "reference/terrain.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

using Bytes = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Islands = nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Codes = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Any = nb::ndarray<nb::ro, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// A surface in a tree; the arrays must outlive it (kernels/reference keeps them).
struct Measured {
    Measured(Rows<float> positions, Rows<std::uint32_t> triangles)
        : tree(reference::Surface{flat(positions), flat(triangles)}) {}
    reference::Tree tree;
};

nb::tuple surface_distance(const Measured &from, const Measured &to, std::uint64_t samples,
                           unsigned threads) {
    reference::Distance found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::one_sided(from.tree, to.tree, samples, threads);
    }
    return nb::make_tuple(found.max, found.rms, found.p99);
}

nb::tuple two_sided(const Measured &a, const Measured &b, std::uint64_t samples, double gap,
                    double resolution, unsigned threads) {
    reference::TwoSided found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::two_sided(a.tree, b.tree, samples, gap, resolution, threads);
    }
    return nb::make_tuple(found.max.least, found.max.most, found.rms, found.p99);
}

std::span<const float> rows_or_none(const nb::object &rows) {
    if (rows.is_none()) {
        return {};
    }
    const auto array = nb::cast<Rows<float>>(rows); // the caller holds the array
    return flat(array);
}

reference::Shading shading(Rows<std::uint32_t> triangles, Rows<float> normals, const nb::object &tangents,
                           const nb::object &uvs) {
    return {flat(triangles), flat(normals), rows_or_none(tangents), rows_or_none(uvs)};
}

// The arrays of both shadings and of the map are held by the caller.
nb::tuple normal_angles(const Measured &from, const reference::Shading &seen, const Measured &to,
                        const reference::Shading &truth, const nb::object &map, unsigned across,
                        unsigned down, double near, std::uint64_t samples, unsigned threads) {
    reference::NormalMap vectors;
    if (!map.is_none()) {
        const auto array = nb::cast<Values>(map);
        vectors = {flat(array), array.shape(0), array.shape(1), static_cast<reference::Wrap>(across),
                   static_cast<reference::Wrap>(down)};
    }
    reference::Angles found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::normal_angles(from.tree, seen, to.tree, truth, vectors, near, samples, threads);
    }
    const auto &[plain, mapped] = found;
    return nb::make_tuple(nb::make_tuple(plain.mean, plain.p99, plain.max),
                          nb::make_tuple(mapped.mean, mapped.p99, mapped.max));
}

nb::tuple uv_shift(const Measured &from, const reference::Shading &seen, const Measured &to,
                   const reference::Shading &truth, double unit, std::uint64_t samples, unsigned threads) {
    reference::Spread found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::uv_shift(from.tree, seen, to.tree, truth, unit, samples, threads);
    }
    return nb::make_tuple(found.mean, found.p99, found.max);
}

nb::tuple terrain_error(Rows<float> positions, Rows<std::uint32_t> triangles, Rows<float> heights,
                        double size_x_m, double size_z_m, int threads) {
    const reference::HeightField height_field{flat(heights), heights.shape(0), heights.shape(1), size_x_m,
                                              size_z_m};
    reference::TerrainError found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::terrain_error(flat(positions), flat(triangles), height_field, threads);
    }
    return nb::make_tuple(found.max_m, found.squares, found.covered, found.holes, found.flipped, found.worst);
}

nb::tuple patch_error(Rows<float> positions, Rows<std::uint32_t> triangles, Rows<float> heights,
                      double size_x_m, double size_z_m,
                      const std::vector<std::vector<std::int64_t>> &corners) {
    const reference::HeightField height_field{flat(heights), heights.shape(0), heights.shape(1), size_x_m,
                                              size_z_m};
    std::array<reference::GridPoint, 3> places{};
    for (std::size_t k = 0; k < 3; ++k) {
        places[k] = {corners.at(k).at(0), corners.at(k).at(1)};
    }
    reference::PatchError found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::patch_error(flat(positions), flat(triangles), height_field, places);
    }
    const reference::TerrainError &inside = found.inside;
    return nb::make_tuple(inside.max_m, inside.squares, inside.covered, inside.holes, inside.flipped,
                          inside.worst, found.strays);
}

nb::tuple loading(Rows<float> positions, Column<double> origin, Rows<double> texts,
                  Rows<std::uint32_t> triangles) {
    reference::Loading found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::loading(flat(positions), flat(origin), flat(texts), flat(triangles));
    }
    const auto &[x, y, z] = found.low;
    const auto &[u, v, w] = found.high;
    return nb::make_tuple(found.max, nb::make_tuple(x, y, z), nb::make_tuple(u, v, w), found.collapsed,
                          found.first, found.turned_p99_deg);
}

nb::object angles_deg(Rows<float> a, Rows<float> b) {
    auto *out = new std::vector<double>(a.shape(0));
    nb::capsule owner(out, [](void *p) noexcept { delete static_cast<std::vector<double> *>(p); });
    {
        nb::gil_scoped_release unlocked;
        reference::angles_deg(flat(a), flat(b), *out);
    }
    return nb::cast(nb::ndarray<nb::numpy, double>(out->data(), {out->size()}, owner));
}

nb::object powers(nb::ndarray<nb::numpy, const double, nb::ndim<1>, nb::c_contig> bases, double exponent) {
    auto *out = new std::vector<double>(bases.size());
    nb::capsule owner(out, [](void *p) noexcept { delete static_cast<std::vector<double> *>(p); });
    {
        nb::gil_scoped_release unlocked;
        for (std::size_t i = 0; i < out->size(); ++i) {
            (*out)[i] = mathx::pow(bases.data()[i], exponent);
        }
    }
    return nb::cast(nb::ndarray<nb::numpy, double>(out->data(), {out->size()}, owner));
}

nb::object corner_tangents(Rows<float> positions, Rows<float> normals, Rows<float> uvs,
                           Rows<std::uint32_t> triangles) {
    auto *out = new std::vector<float>(triangles.size() * 4);
    nb::capsule owner(out, [](void *p) noexcept { delete static_cast<std::vector<float> *>(p); });
    {
        nb::gil_scoped_release unlocked;
        reference::corner_tangents(flat(positions), flat(normals), flat(uvs), flat(triangles), *out);
    }
    return nb::cast(nb::ndarray<nb::numpy, float>(out->data(), {triangles.shape(0), 3, 4}, owner));
}

// (format, channels, rows, columns, levels)
struct Texture {
    Texture(int format, std::size_t channels, std::size_t rows, std::size_t columns,
            const std::vector<Bytes> &levels)
        : view{static_cast<reference::Texels>(format), channels, {rows, columns}, {}} {
        for (const Bytes &level : levels) {
            view.levels.emplace_back(level.data(), level.size());
        }
    }
    reference::TextureView view;
};

// codes: None, or rising heights with the derivative of the exact taps; then whether the slopes are held.
reference::HeightMap height_map(const Rows<float> &heights, std::vector<double> derivative,
                                std::vector<double> smooth, std::pair<double, double> scale,
                                std::pair<bool, bool> wrap, bool green_down, const nb::object &islands,
                                const nb::object &codes, std::vector<double> exact, bool held, bool cones) {
    reference::HeightMap out;
    out.heights = flat(heights);
    out.size = {heights.shape(0), heights.shape(1)};
    out.taps = {std::move(derivative), std::move(smooth)};
    out.exact = {std::move(exact), {1.0}};
    out.held = held;
    out.cones = cones;
    if (!codes.is_none()) {
        out.codes = flat(nb::cast<Codes>(codes)); // the caller holds the array
    }
    out.scale_x = scale.first;
    out.scale_y = scale.second;
    out.wrap_x = wrap.first;
    out.wrap_y = wrap.second;
    out.green_down = green_down;
    if (!islands.is_none()) {
        const auto ids = nb::cast<Islands>(islands); // the caller holds the array
        out.islands = flat(ids);
    }
    return out;
}

// vectors: (rows, columns, 3), unit. The caller holds both arrays.
reference::HeightMap drawn(Values vectors, const nb::object &islands) {
    reference::HeightMap out;
    out.drawn = flat(vectors);
    out.size = {vectors.shape(0), vectors.shape(1)};
    out.taps = {{}, {1.0}};
    if (!islands.is_none()) {
        out.islands = flat(nb::cast<Islands>(islands));
    }
    return out;
}

using LevelErrors = std::vector<reference::LevelError>;

// One tuple a level: count, sum, p99, max, sum of alpha's squares, count of alpha's texels.
nb::list as_list(const LevelErrors &found) {
    nb::list out;
    for (const reference::LevelError &level : found) {
        out.append(nb::make_tuple(level.count, level.sum, level.p99, level.max, level.alpha_squares,
                                  level.alpha_count));
    }
    return out;
}

nb::list normal_levels(const Texture &texture, const reference::HeightMap &truth, bool offsets, int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = offsets ? reference::offset_levels(texture.view, truth, threads)
                        : reference::normal_levels(texture.view, truth, threads);
    }
    return as_list(found);
}

nb::list filter_angles(const reference::HeightMap &a, const reference::HeightMap &b, int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = {reference::filter_angles(a, b, threads)};
    }
    return as_list(found);
}

nb::list open_angles(const reference::HeightMap &heights, int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = {reference::open_angles(heights, threads)};
    }
    return as_list(found);
}

nb::list value_levels(const Texture &texture, Values values, int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::value_levels(texture.view, flat(values), values.shape(2), threads);
    }
    return as_list(found);
}

nb::list gloss_levels(const Texture &texture, Values gloss, const reference::HeightMap &truth, int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::gloss_levels(texture.view, flat(gloss), truth, threads);
    }
    return as_list(found);
}

nb::list highlight_levels(const Texture &texture, Values gloss, const reference::HeightMap &truth,
                          int threads) {
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::highlight_levels(texture.view, flat(gloss), truth, threads);
    }
    return as_list(found);
}

nb::list color_levels(const Texture &texture, Any pixels, bool encoded, double cutoff, int threads) {
    using Kind = reference::Pixels::Kind;
    Kind kind = Kind::f32;
    if (pixels.dtype() == nb::dtype<std::uint8_t>()) {
        kind = Kind::u8;
    } else if (pixels.dtype() == nb::dtype<std::uint16_t>()) {
        kind = Kind::u16;
    } else if (pixels.dtype() != nb::dtype<float>()) {
        throw nb::type_error("pixels are uint8, uint16 or float32");
    }
    const reference::Pixels view{kind, pixels.data(), pixels.shape(2), encoded};
    LevelErrors found;
    {
        nb::gil_scoped_release unlocked;
        found = reference::color_levels(texture.view, view, cutoff, threads);
    }
    return as_list(found);
}

nb::object open_shares(Rows<double> points, Rows<double> normals, Rows<double> faces, Rows<double> corners,
                       double reach, std::size_t cells, int threads) {
    std::vector<double> shares(points.shape(0));
    {
        nb::gil_scoped_release unlocked;
        reference::open_shares(flat(points), flat(normals), flat(faces), flat(corners), reach, cells, shares,
                               threads);
    }
    return give(std::move(shares));
}

} // namespace

NB_MODULE(_reference, m) {
    m.doc() = "Reference kernels for metrics.";
    nb::class_<Measured>(m, "Surface")
        .def(nb::init<Rows<float>, Rows<std::uint32_t>>(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
             nb::call_guard<nb::gil_scoped_release>());
    m.def("open_shares", &open_shares);
    m.def("surface_distance", &surface_distance);
    m.def("two_sided", &two_sided);
    nb::class_<reference::Shading>(m, "Shading");
    m.def("shading", &shading, nb::arg("triangles"), nb::arg("normals"), nb::arg("tangents").none(),
          nb::arg("uvs").none());
    m.def("normal_angles", &normal_angles, nb::arg("from"), nb::arg("seen"), nb::arg("to"), nb::arg("truth"),
          nb::arg("map").none(), nb::arg("across"), nb::arg("down"), nb::arg("near"), nb::arg("samples"),
          nb::arg("threads"));
    m.def("uv_shift", &uv_shift);
    m.def("terrain_error", &terrain_error);
    m.def("patch_error", &patch_error);
    m.def("loading", &loading);
    m.def("angles_deg", &angles_deg);
    m.def("powers", &powers);
    m.def("corner_tangents", &corner_tangents);
    nb::class_<Texture>(m, "Texture")
        .def(nb::init<int, std::size_t, std::size_t, std::size_t, const std::vector<Bytes> &>(),
             nb::keep_alive<1, 6>());
    nb::class_<reference::HeightMap>(m, "HeightMap");
    m.def("height_map", &height_map, nb::arg("heights"), nb::arg("derivative"), nb::arg("smooth"),
          nb::arg("scale"), nb::arg("wrap"), nb::arg("green_down"), nb::arg("islands").none(),
          nb::arg("codes").none(), nb::arg("exact"), nb::arg("held"), nb::arg("cones"),
          nb::keep_alive<0, 1>(), nb::keep_alive<0, 7>(), nb::keep_alive<0, 8>());
    m.def("drawn", &drawn, nb::arg("vectors"), nb::arg("islands").none(), nb::keep_alive<0, 1>(),
          nb::keep_alive<0, 2>());
    m.def("normal_levels", &normal_levels);
    m.def("filter_angles", &filter_angles);
    m.def("open_angles", &open_angles);
    m.def("value_levels", &value_levels);
    m.def("gloss_levels", &gloss_levels);
    m.def("highlight_levels", &highlight_levels);
    m.def("color_levels", &color_levels);
    bind_reference_layout(m);
    bind_reference_seen(m);
}
