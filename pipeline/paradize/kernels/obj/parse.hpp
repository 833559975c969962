// Wavefront OBJ text -> indexed triangles with unique vertices.
// Format: Wavefront, "Advanced Visualizer Manual, Appendix B1. Object Files (.obj)", 1992.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "obj/buffer.hpp"

namespace paradize::obj {

inline constexpr std::uint32_t absent = 0xffffffffu;

struct Limits {
    std::uint64_t elements = 200'000'000;  // of v, vt or vn, or of face corners
    std::uint64_t ear_tests = 400'000'000; // for all polygons of the file together
    std::uint64_t max_faults = 8;
    std::uint64_t max_keywords = 32;
};

// Something the reader left out or filled in: `what` is a stable code or, for keywords, "keyword:<name>".
struct Note {
    std::string what;
    std::uint64_t count;
    std::uint64_t line; // of the first one, from 1
};

// Something that makes the file unusable.
struct Fault {
    std::string what;
    std::uint64_t line;
};

// A run of triangles with the same state. Names are indices into Parsed::names, or `absent`.
struct Run {
    std::uint32_t first_triangle;
    std::uint32_t object, group, material;
    std::uint32_t smoothing; // 0 is off, absent is "the file does not say"
};

struct Parsed {
    // Unique vertices in the order of their first use. Positions in file units, counted from `origin`, uvs
    // with the origin turned to the top-left (v' = 1 - v). Vectors are empty where no face refers to such
    // data; a vertex without its own has zeros (a zero normal means "missing"), colours are then 1.
    std::array<double, 3> origin{}; // 0 where the positions lie near it (obj/origin.hpp)
    Buffer<float> positions;        // 3 a vertex
    Buffer<double> texts;           // 3: the position in the text; of several that became one, the farthest
    Buffer<float> normals;          // 3
    Buffer<float> uvs;              // 2
    Buffer<float> colors;           // 4, RGBA
    Buffer<std::uint32_t> triangles;
    Buffer<std::uint32_t> triangle_lines; // line of each triangle's face
    std::vector<Run> runs;
    std::vector<std::string> names;       // bytes as in the file
    std::vector<std::uint32_t> libraries; // names of mtllib statements, whole rest of the line
    std::vector<Note> notes;
    std::vector<Fault> faults; // when any: the vectors above are not filled in
    std::uint64_t fault_count = 0;
    std::uint64_t faces = 0; // face statements with three corners or more
    std::uint64_t positions_in_file = 0;
    std::uint64_t positions_unused = 0; // those that no face names
    // Triangles with an area in the text of which two corners became one vertex, and the first of them.
    std::uint64_t collapsed = 0;
    std::uint32_t first_collapsed = 0;
};

// Reads a whole file's text. LF, CR and CRLF end lines, a backslash before the end of a line continues it, a
// UTF-8 byte order mark is skipped. Never throws on bad input (std::bad_alloc apart): see Parsed::faults.
Parsed parse(std::string_view text, const Limits &limits);

// Reads from the place of a file descriptor to its end, in blocks that stay in the processor's cache, so that
// the text is never in memory as a whole. Returns false, with errno set, where reading fails; ESTALE: the
// file changed its size meanwhile.
bool parse_file(int descriptor, const Limits &limits, Parsed &out);

} // namespace paradize::obj
