// Makes triangles with unique vertices from the results of the scanner of an OBJ file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "obj/buffer.hpp"
#include "obj/parse.hpp"

namespace paradize::obj {

struct Corner {
    std::uint32_t position, uv, normal; // `absent` where a corner has none
    bool operator==(const Corner &) const = default;
};

struct Face {
    std::uint32_t count, line; // its corners follow those of the face before
};

struct FaceRun {
    std::uint32_t first_face;
    Run state;
};

// A file's elements in the order of the text.
struct Elements {
    Buffer<double> positions; // 3 each
    Buffer<float> colors;     // 4 a position, or none at all
    Buffer<float> uvs;        // 2, as in the file
    Buffer<float> normals;    // 3
    Buffer<Corner> corners;   // indices from 0
    Buffer<Face> faces;
    std::vector<FaceRun> runs;
    bool new_run = true; // the next face may have another state than the last run's
};

// Notes by their code: counted, with the line of the first.
class Notes {
  public:
    explicit Notes(std::vector<Note> &notes) : notes_(notes) {}
    void add(std::string_view what, std::uint64_t line);
    bool has(const std::string &what) const { return number_.contains(what); }
    std::size_t size() const { return notes_.size(); }

  private:
    std::vector<Note> &notes_;
    std::unordered_map<std::string, std::size_t> number_;
};

// Cuts faces into triangles, shares equal vertices and fills in `out`. Indices are in range; `elements` is
// used up.
void assemble(Elements &elements, const Limits &limits, Notes &notes, Parsed &out);

} // namespace paradize::obj
