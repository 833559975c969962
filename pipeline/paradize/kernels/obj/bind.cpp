// Python face of the OBJ kernels: bytes in, numpy arrays out.
#include <nanobind/stl/string.h>

#include <cerrno>
#include <string_view>
#include <utility>

#include "bind.hpp"
#include "obj/origin.hpp"
#include "obj/parse.hpp"
#include "obj/triangulate.hpp"

namespace nb = nanobind;
using namespace paradize;
using namespace paradize::bind;

namespace {

nb::bytes as_bytes(const std::string &text) {
    return nb::bytes(text.data(), text.size());
}

nb::dict as_dict(obj::Parsed &&parsed) {
    nb::dict out;
    nb::list faults, notes, names, libraries, runs;
    for (const auto &fault : parsed.faults)
        faults.append(nb::make_tuple(as_bytes(fault.what), fault.line));
    for (const auto &note : parsed.notes)
        notes.append(nb::make_tuple(as_bytes(note.what), note.count, note.line));
    for (const auto &name : parsed.names)
        names.append(as_bytes(name));
    for (const auto library : parsed.libraries)
        libraries.append(library);
    for (const auto &run : parsed.runs)
        runs.append(nb::make_tuple(run.first_triangle, run.object, run.group, run.material, run.smoothing));
    out["faults"] = faults;
    out["fault_count"] = parsed.fault_count;
    out["notes"] = notes;
    out["names"] = names;
    out["libraries"] = libraries;
    out["runs"] = runs;
    out["faces"] = parsed.faces;
    out["positions_in_file"] = parsed.positions_in_file;
    out["positions_unused"] = parsed.positions_unused;
    out["collapsed"] = parsed.collapsed;
    out["first_collapsed"] = parsed.first_collapsed;
    out["origin"] = nb::make_tuple(parsed.origin[0], parsed.origin[1], parsed.origin[2]);
    out["positions"] = give(std::move(parsed.positions), 3);
    out["texts"] = give(std::move(parsed.texts), 3);
    out["normals"] = give(std::move(parsed.normals), 3);
    out["uvs"] = give(std::move(parsed.uvs), 2);
    out["colors"] = give(std::move(parsed.colors), 4);
    out["triangles"] = give(std::move(parsed.triangles), 3);
    out["triangle_lines"] = give(std::move(parsed.triangle_lines));
    return out;
}

nb::dict parse_text(nb::bytes text) {
    obj::Parsed parsed;
    {
        const std::string_view view(text.c_str(), text.size());
        nb::gil_scoped_release unlocked;
        parsed = obj::parse(view, obj::Limits{});
    }
    return as_dict(std::move(parsed));
}

// Raises OSError where reading fails, ESTALE where the file grows or shrinks meanwhile.
nb::dict parse_file(int descriptor) {
    obj::Parsed parsed;
    bool sound = false;
    int reason = 0;
    {
        nb::gil_scoped_release unlocked;
        sound = obj::parse_file(descriptor, obj::Limits{}, parsed);
        reason = errno;
    }
    if (!sound) {
        errno = reason;
        PyErr_SetFromErrno(PyExc_OSError);
        throw nb::python_error();
    }
    return as_dict(std::move(parsed));
}

// positions: (n, 3). triangles: (m, 3), inside them: the Python face checks it.
nb::tuple origin_of(const Rows<double> &positions, const Rows<std::uint32_t> &triangles) {
    std::vector<obj::Corner> corners;
    corners.reserve(triangles.size());
    for (const std::uint32_t position : flat(triangles))
        corners.push_back({.position = position, .uv = obj::absent, .normal = obj::absent});
    const auto origin = obj::origin_of(flat(positions), corners);
    return nb::make_tuple(origin[0], origin[1], origin[2]);
}

// positions: (n, 3). corners: of all polygons, one after the other. counts: of each polygon, at least 3. The
// Python face checks all. Returns corner numbers of triangles (m, 3), and how many outlines cross themselves.
nb::tuple cut_polygons(const Rows<double> &positions, const Column<std::uint32_t> &corners,
                       const Column<std::uint32_t> &counts) {
    std::vector<std::uint32_t> triangles, cuts;
    std::uint64_t crossing = 0, ear_tests = obj::Limits{}.ear_tests;
    {
        nb::gil_scoped_release unlocked;
        obj::Triangulator triangulator;
        std::vector<std::array<double, 3>> outline;
        std::uint32_t first = 0;
        for (const std::uint32_t count : flat(counts)) {
            outline.resize(count);
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t k = 0; k < 3; ++k)
                    outline[i][k] = positions.data()[corners.data()[first + i] * std::size_t{3} + k];
            cuts.clear();
            const obj::Cut cut = triangulator.cut(outline, ear_tests, cuts);
            crossing += cut == obj::Cut::crossing || cut == obj::Cut::unchecked;
            for (const std::uint32_t corner : cuts)
                triangles.push_back(first + corner);
            first += count;
        }
    }
    return nb::make_tuple(give(std::move(triangles), 3), crossing);
}

} // namespace

NB_MODULE(_obj, m) {
    m.doc() = "Reads Wavefront OBJ text.";
    m.def("parse", &parse_text, nb::arg("text"));
    m.def("parse_file", &parse_file, nb::arg("descriptor"));
    m.def("cut_polygons", &cut_polygons, nb::arg("positions"), nb::arg("corners"), nb::arg("counts"));
    m.def("origin_of", &origin_of, nb::arg("positions"), nb::arg("triangles"));
}
