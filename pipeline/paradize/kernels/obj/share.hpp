// Vertices of a file: corners with the same indices are one, then those with the same values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "obj/assemble.hpp"
#include "obj/origin.hpp"

namespace paradize::obj {

// Numbers corners in the order of first use; those with equal indices share a number. Vertices hang in a list
// at their position; where lists grow long, all move into a hash table.
class Vertices {
  public:
    struct Vertex {
        Corner corner;
        std::uint32_t next;
    };

    explicit Vertices(std::size_t positions) { head_.assign(positions, absent); }

    // corner.position is below `positions`.
    std::uint32_t number(const Corner &corner) {
        if (steps_left_ <= 0) [[unlikely]]
            return hashed(corner);
        std::uint32_t *link = &head_[corner.position];
        std::uint32_t at = *link;
        while (at != absent) {
            Vertex &here = vertices_[at];
            if (here.corner.uv == corner.uv && here.corner.normal == corner.normal)
                return at;
            link = &here.next;
            at = *link;
            --steps_left_;
        }
        steps_left_ += 4;
        at = static_cast<std::uint32_t>(vertices_.size());
        *link = at; // before `vertices_` may move
        vertices_.push_back({corner, absent});
        return at;
    }

    std::span<const Vertex> all() const { return vertices_; }

  private:
    std::uint32_t hashed(const Corner &corner);
    void fill_table(std::size_t slots);

    Buffer<std::uint32_t> head_; // first vertex of each position
    Buffer<Vertex> vertices_;
    std::int64_t steps_left_ = 1 << 16;
    Buffer<std::uint32_t> table_; // once lists are given up
};

// The sources of the vertices' rows; empty where they get none.
struct Rows {
    std::span<const double> positions;           // 3 a row
    std::span<const float> uvs, normals, colors; // 2, 3, 4
    Origin origin;                               // of the vertices' positions
};

// A coordinate as vertices have it.
inline float local(double coordinate, double origin) {
    return static_cast<float>(coordinate - origin);
}

// Fills in rows for all vertices, zeros where an index is absent, v turned to the top-left origin. Vertices
// with equal rows (0 equals -0) become one, numbered in order of first use, and out.triangles follow.
void share_by_value(std::span<const Vertices::Vertex> vertices, const Rows &rows, Parsed &out);

} // namespace paradize::obj
