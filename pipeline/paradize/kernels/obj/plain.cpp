#include "obj/plain.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "obj/lines.hpp"
#include "obj/marks.hpp"

namespace paradize::obj {
namespace {

// Lets wide readers, where there are any, take what they take and the plain ones the line after that.
template <typename Take>
std::size_t take(Take &&some) {
    static const LineReaders *const wide = wide_readers();
    const std::size_t found = wide ? some(*wide, ~std::size_t{0}) : 0;
    return found + some(plain_readers, wide ? 1 : ~std::size_t{0});
}

template <std::size_t width, typename Real>
std::size_t take_numbers(NumberReader<Real> *LineReaders::*kind, Lines &lines, Buffer<Real> &into,
                         std::size_t most) {
    Real *out = into.extend(width * most + 1);
    const std::size_t found = take([&](const LineReaders &readers, std::size_t lines_most) {
        const std::size_t here = (readers.*kind)(lines, lines_most, out);
        out += width * here;
        return here;
    });
    into.resize(into.size() + width * found);
    return found;
}

std::size_t take_faces(Lines &lines, std::uint64_t line, Elements &elements, std::size_t bytes) {
    const std::uint32_t have[3] = {static_cast<std::uint32_t>(elements.positions.size() / 3),
                                   static_cast<std::uint32_t>(elements.uvs.size() / 2),
                                   static_cast<std::uint32_t>(elements.normals.size() / 3)};
    // A corner has 2 bytes at least, a face 8.
    Corner *corners = elements.corners.extend(bytes / 2 + 2);
    Face *faces = elements.faces.extend(bytes / 8 + 1);
    const std::size_t found = take([&](const LineReaders &readers, std::size_t most) {
        const std::size_t here = readers.faces(lines, most, have, line, corners, faces);
        faces += here;
        line += here;
        return here;
    });
    elements.faces.resize(elements.faces.size() + found);
    elements.corners.resize(static_cast<std::size_t>(corners - elements.corners.data()));
    return found;
}

} // namespace

const char *PlainLines::read(const char *p, const char *end, const char *readable, Elements &elements,
                             std::uint64_t &line) {
    if constexpr (std::endian::native != std::endian::little)
        return p;
    while (p < end) {
        if (p < from_ || p >= to_ || !std::memchr(p, '\n', static_cast<std::size_t>(to_ - p))) {
            const std::size_t here = std::min(words, static_cast<std::size_t>(readable - p) / 64);
            if (here < 2)
                return p;
            mark(p, here, breaks_, ends_);
            breaks_[here] = breaks_[here + 1] = 0;
            from_ = p;
            to_ = p + 64 * here;
        }
        const std::size_t word = static_cast<std::size_t>(p - from_) / 64;
        const std::size_t marked = static_cast<std::size_t>(to_ - from_) / 64;
        Lines lines{p,      end,     readable - line_slack,
                    from_,  breaks_, ends_,
                    marked, word,    ends_[word] & ~std::uint64_t{0} << (p - from_) % 64};
        const char *const first = p;
        std::size_t found = 1;
        while (found > 0) {
            // A line of `v` has 8 bytes at least, of `vt` 7, of `vn` 9.
            const auto bytes = static_cast<std::size_t>(to_ - p);
            if (*p == 'f' && !elements.new_run)
                found = take_faces(lines, line, elements, bytes);
            else if (*p == 'v' && p[1] == ' ' && elements.colors.empty())
                found = take_numbers<3>(&LineReaders::positions, lines, elements.positions, bytes / 8 + 1);
            else if (*p == 'v' && p[1] == 't')
                found = take_numbers<2>(&LineReaders::uvs, lines, elements.uvs, bytes / 7 + 1);
            else if (*p == 'v' && p[1] == 'n')
                found = take_numbers<3>(&LineReaders::normals, lines, elements.normals, bytes / 9 + 1);
            else
                found = 0;
            line += found;
            p = lines.p;
        }
        // A line that none took, unless it is only that its end is not marked.
        if (p == first || (p < to_ && std::memchr(p, '\n', static_cast<std::size_t>(to_ - p))))
            return p;
    }
    return p;
}

} // namespace paradize::obj
