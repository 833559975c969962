#include "obj_assemble.hpp"

#include <algorithm>
#include <array>

#include "obj_triangulate.hpp"
#include "unify.hpp"

namespace paradize::obj {
namespace {

class Assembler {
  public:
    Assembler(Elements &elements, const Limits &limits, Notes &notes, Parsed &out)
        : elements_(elements), limits_(limits), notes_(notes), out_(out) {}

    // --------------------------------------------------------------------------------
    void run() {
        share_equal_rows();
        std::vector<std::uint32_t> cuts; // corner number of each triangle corner
        cuts.reserve(elements_.corners.size() * 2);
        std::vector<std::array<double, 3>> outline;
        std::vector<std::uint32_t> local;
        std::uint64_t work = limits_.ear_tests;
        std::size_t run = 0;
        for (std::size_t f = 0; f < elements_.faces.size(); ++f) {
            const Face &face = elements_.faces[f];
            if (run < elements_.runs.size() && elements_.runs[run].first_face == f) {
                elements_.runs[run].state.first_triangle = static_cast<std::uint32_t>(cuts.size() / 3);
                out_.runs.push_back(elements_.runs[run++].state);
            }
            line_ = face.line;
            local.clear();
            if (face.count == 3) {
                local = {0, 1, 2};
            } else {
                outline.resize(face.count);
                for (std::size_t i = 0; i < face.count; ++i)
                    for (std::size_t k = 0; k < 3; ++k)
                        outline[i][k] =
                            elements_.positions[elements_.corners[face.first_corner + i].position *
                                                    std::size_t{3} +
                                                k];
                const Cut cut = triangulate(outline, work, local);
                if (cut == Cut::crossing)
                    note("crossing_polygons");
                else if (cut == Cut::unchecked)
                    note("unchecked_polygons");
            }
            for (const std::uint32_t i : local)
                cuts.push_back(face.first_corner + i);
            out_.triangle_lines.insert(out_.triangle_lines.end(), local.size() / 3, face.line);
            count_missing(face);
        }
        fill_vertices(cuts);
    }

  private:
    void note(std::string_view what) { notes_.add(what, line_); }

    void count_missing(const Face &face) {
        bool uv = true, normal = true;
        for (std::size_t i = 0; i < face.count; ++i) {
            uv = uv && elements_.corners[face.first_corner + i].uv != absent;
            normal = normal && elements_.corners[face.first_corner + i].normal != absent;
        }
        any_uv_ = any_uv_ || uv;
        any_normal_ = any_normal_ || normal;
        if (!uv)
            note("faces_without_uv");
        if (!normal)
            note("faces_without_normal");
    }

    // Exporters repeat equal values under new numbers; vertices are shared by value.
    void share_equal_rows() {
        Numbered same;
        if (elements_.colors.empty()) {
            same = number_rows(elements_.positions, 3);
        } else {
            std::vector<float> rows;
            rows.reserve(elements_.positions.size() / 3 * 7);
            for (std::size_t i = 0; i < elements_.positions.size() / 3; ++i) {
                rows.insert(rows.end(), &elements_.positions[i * 3], &elements_.positions[i * 3] + 3);
                rows.insert(rows.end(), &elements_.colors[i * 4], &elements_.colors[i * 4] + 4);
            }
            same = number_rows(rows, 7);
        }
        const Numbered same_uv = number_rows(elements_.uvs, 2);
        const Numbered same_normal = number_rows(elements_.normals, 3);
        for (Corner &c : elements_.corners) {
            c.position = same.first[same.index[c.position]];
            c.uv = c.uv == absent ? absent : same_uv.first[same_uv.index[c.uv]];
            c.normal = c.normal == absent ? absent : same_normal.first[same_normal.index[c.normal]];
        }
    }

    void fill_vertices(const std::vector<std::uint32_t> &cuts) {
        Numbered unified = number_equal(
            cuts.size(),
            [&](std::size_t i) {
                const Corner &c = elements_.corners[cuts[i]];
                return mix(mix(mix(hash_seed, c.position), c.uv), c.normal);
            },
            [&](std::size_t a, std::size_t b) {
                return elements_.corners[cuts[a]] == elements_.corners[cuts[b]];
            });
        out_.triangles = std::move(unified.index);
        const std::size_t n = unified.first.size();
        out_.positions.resize(n * 3);
        out_.uvs.resize(any_uv_ ? n * 2 : 0);
        out_.normals.resize(any_normal_ ? n * 3 : 0);
        out_.colors.resize(elements_.colors.empty() ? 0 : n * 4);
        for (std::size_t i = 0; i < n; ++i) {
            const Corner &c = elements_.corners[cuts[unified.first[i]]];
            std::copy_n(&elements_.positions[c.position * std::size_t{3}], 3, &out_.positions[i * 3]);
            if (any_uv_ && c.uv != absent) {
                out_.uvs[i * 2] = elements_.uvs[c.uv * std::size_t{2}];
                out_.uvs[i * 2 + 1] = 1.0f - elements_.uvs[c.uv * std::size_t{2} + 1];
            }
            if (any_normal_ && c.normal != absent)
                std::copy_n(&elements_.normals[c.normal * std::size_t{3}], 3, &out_.normals[i * 3]);
            if (!elements_.colors.empty())
                std::copy_n(&elements_.colors[c.position * std::size_t{4}], 4, &out_.colors[i * 4]);
        }
    }

    Elements &elements_;
    const Limits &limits_;
    Notes &notes_;
    Parsed &out_;
    std::uint64_t line_ = 0;
    bool any_uv_ = false, any_normal_ = false;
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
