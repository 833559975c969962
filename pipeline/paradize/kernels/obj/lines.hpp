// Marked lines of text, one after the other, and the readers of runs of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "obj/assemble.hpp"

namespace paradize::obj {

// Bytes behind the end of a line that its reading may look at.
inline constexpr std::ptrdiff_t line_slack = 64 + 8;

// A place among lines whose breaks and ends are marked (obj/marks.hpp), and which are looked at next.
struct Lines {
    const char *p;                      // the start of a line
    const char *end, *limit;            // no line that begins from `end` on or ends from `limit` on is read
    const char *marked;                 // where the marks begin
    const std::uint64_t *breaks, *ends; // `words` of them; one more of `breaks` may be looked at
    std::size_t words, word;            // `word`: the one that is looked at
    std::uint64_t left;                 // of ends[word]: lines that end at p or later
};

// Readers take consecutive lines of one kind as long as they are plain, write what these hold and return how
// many they were; `lines` moves behind them. At most `most` lines are taken. Behind the values one more may
// be written.
template <typename Real>
using NumberReader = std::size_t(Lines &lines, std::size_t most, Real *out);
// Indices lie in 1 .. have[kind]; the first face has line number `line`; `corners` moves behind the last.
using FaceReader = std::size_t(Lines &lines, std::size_t most, const std::uint32_t have[3],
                               std::uint64_t line, Corner *&corners, Face *faces);

struct LineReaders {
    NumberReader<double> *positions;    // `v x y z`
    NumberReader<float> *uvs, *normals; // `vt u v`, `vn x y z`
    FaceReader *faces;
};

// Lines whose numbers have at most 7 digits before and 8 behind the point, 8 of an index, for every
// instruction set; other numbers go through read_number. Little endian.
extern const LineReaders plain_readers;

// The same values, sooner, of numbers with a point and of corners v/vt/vn; other lines are left. Null where
// this CPU lacks AVX2 or BMI2.
const LineReaders *wide_readers();

} // namespace paradize::obj
