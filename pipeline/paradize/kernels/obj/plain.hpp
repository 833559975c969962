// The lines that make up nearly all of an OBJ file, read without a detour: `v x y z`, `vt u v [w]`, `vn x y
// z` and `f` with corners v, v/vt, v//vn or v/vt/vn of plain positive indices that are there already.
#pragma once

#include <cstddef>
#include <cstdint>

#include "obj/assemble.hpp"

namespace paradize::obj {

class PlainLines {
  public:
    // Reads such lines from `p`, the start of a line, into `elements` until one is of another kind or looks
    // odd in any way, and returns where that line starts; `line` is the number of the line at `p`, counted
    // on. Up to `readable` memory may be read; every line that begins below `end` ends below it.
    const char *read(const char *p, const char *end, const char *readable, Elements &elements,
                     std::uint64_t &line);

    // The text is no longer what it was.
    void forget() { from_ = to_ = nullptr; }

  private:
    static constexpr std::size_t words = 256; // of marks: few enough to stay in the nearest cache

    const char *from_ = nullptr, *to_ = nullptr; // what is marked: whole words
    std::uint64_t breaks_[words + 2] = {}, ends_[words + 2] = {};
};

} // namespace paradize::obj
