// Where tokens and lines end in a stretch of text, found for all of its bytes at once.
// Source of the idea: G. Langdale and D. Lemire, "Parsing gigabytes of JSON per second", 2019, section 3.1.
#pragma once

#include <cstddef>
#include <cstdint>

namespace paradize::obj {

// Bit i % 64 of word i / 64 is set where text[i] is no digit (`breaks`) and where it is LF (`ends`), for the
// first 64 * words bytes. Of all ways to find them, the widest that this CPU knows is taken.
void mark(const char *text, std::size_t words, std::uint64_t *breaks, std::uint64_t *ends);

} // namespace paradize::obj
