#include "obj/assemble.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "obj/origin.hpp"
#include "obj/share.hpp"
#include "obj/triangulate.hpp"

namespace paradize::obj {
namespace {

class Assembler {
  public:
    Assembler(Elements &elements, const Limits &limits, Notes &notes, Parsed &out)
        : elements_(elements), notes_(notes), out_(out), work_(limits.ear_tests),
          origin_(origin_of(elements.positions, elements.corners)), vertices_(elements.positions.size() / 3) {
    }

    void run() {
        const std::size_t corners = elements_.corners.size(), faces = elements_.faces.size();
        const std::size_t triangles = corners - 2 * faces;
        std::uint32_t *into = out_.triangles.extend(triangles * 3);
        std::uint32_t *line = out_.triangle_lines.extend(triangles);
        const Corner *corner = elements_.corners.data();
        std::size_t run = 0;
        for (std::size_t f = 0; f < faces; ++f) {
            const Face face = elements_.faces[f];
            if (run < elements_.runs.size() && elements_.runs[run].first_face == f) {
                elements_.runs[run].state.first_triangle =
                    static_cast<std::uint32_t>(line - out_.triangle_lines.data());
                out_.runs.push_back(elements_.runs[run++].state);
            }
            if (face.count == 3) {
                for (std::size_t k = 0; k < 3; ++k)
                    *into++ = vertices_.number(corner[k]);
                *line++ = face.line;
            } else {
                polygon_.resize(face.count);
                for (std::size_t k = 0; k < face.count; ++k)
                    polygon_[k] = vertices_.number(corner[k]);
                for (const std::uint32_t i : cut_polygon(corner, face))
                    *into++ = polygon_[i];
                line = std::fill_n(line, face.count - 2, face.line);
            }
            count_missing(corner, face);
            corner += face.count;
        }
        out_.triangles.resize(triangles * 3);
        out_.triangle_lines.resize(triangles);
        out_.origin = origin_;
        Rows rows{elements_.positions, {}, {}, elements_.colors, origin_};
        if (any_uv_)
            rows.uvs = elements_.uvs;
        if (any_normal_)
            rows.normals = elements_.normals;
        out_.positions_unused = unused_positions();
        share_by_value(vertices_.all(), rows, out_);
    }

  private:
    const std::vector<std::uint32_t> &cut_polygon(const Corner *corner, Face face) {
        outline_.resize(face.count);
        for (std::size_t i = 0; i < face.count; ++i)
            for (std::size_t k = 0; k < 3; ++k)
                outline_[i][k] =
                    local(elements_.positions[corner[i].position * std::size_t{3} + k], origin_[k]);
        cuts_.clear();
        const Cut result = triangulator_.cut(outline_, work_, cuts_);
        if (result == Cut::crossing)
            notes_.add("crossing_polygons", face.line);
        else if (result == Cut::unchecked)
            notes_.add("unchecked_polygons", face.line);
        return cuts_;
    }

    void count_missing(const Corner *corner, Face face) {
        bool uv = true, normal = true;
        for (std::size_t i = 0; i < face.count; ++i) {
            uv = uv && corner[i].uv != absent;
            normal = normal && corner[i].normal != absent;
        }
        any_uv_ = any_uv_ || uv;
        any_normal_ = any_normal_ || normal;
        if (!uv)
            notes_.add("faces_without_uv", face.line);
        if (!normal)
            notes_.add("faces_without_normal", face.line);
    }

    std::uint64_t unused_positions() const {
        std::vector<bool> used(elements_.positions.size() / 3);
        for (const auto &vertex : vertices_.all())
            used[vertex.corner.position] = true;
        return static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
    }

    Elements &elements_;
    Notes &notes_;
    Parsed &out_;
    std::uint64_t work_;
    const Origin origin_;
    bool any_uv_ = false, any_normal_ = false;
    Vertices vertices_;
    Triangulator triangulator_;
    std::vector<std::uint32_t> polygon_;
    std::vector<std::array<double, 3>> outline_;
    std::vector<std::uint32_t> cuts_;
};

} // namespace

void Notes::add(std::string_view what, std::uint64_t line) {
    const auto [at, fresh] = number_.try_emplace(std::string(what), notes_.size());
    if (fresh)
        notes_.push_back({at->first, 1, line});
    else
        notes_[at->second].count += 1;
}

void assemble(Elements &elements, const Limits &limits, Notes &notes, Parsed &out) {
    Assembler(elements, limits, notes, out).run();
}

} // namespace paradize::obj
