#include "obj/parse.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <sys/stat.h>
#include <unistd.h>

#include "obj/statements.hpp"

namespace paradize::obj {
namespace {

// Where the text may be parted: behind the last line that no backslash continues; 0 where there is none.
std::size_t last_line_end(std::string_view text) {
    std::size_t stop = text.size();
    while (stop > 0) {
        const std::size_t found = text.rfind('\n', stop - 1);
        if (found == text.npos)
            return 0;
        const std::size_t before = text.substr(0, found).find_last_not_of(" \t\r");
        if (before == text.npos || text[before] != '\\')
            return found + 1;
        stop = found;
    }
    return 0;
}

} // namespace

Parsed parse(std::string_view text, const Limits &limits) {
    Statements statements(limits);
    statements.feed(text, 0);
    return statements.finish();
}

bool parse_file(int descriptor, const Limits &limits, Parsed &out) {
    constexpr std::size_t block = std::size_t{256} << 10, slack = 256;
    Statements statements(limits);
    Buffer<char> text;
    std::size_t held = 0, looked_at = 0; // bytes in `text`; of them, known to hold no place to part
    struct stat status = {};
    const off_t place = ::lseek(descriptor, 0, SEEK_CUR);
    if (place < 0 || ::fstat(descriptor, &status) != 0)
        return false;
    off_t left = status.st_size - place; // what grows while it is read would never end
    while (true) {
        if (held + block > text.size())
            text.resize(std::max(held + block, 2 * held) + slack);
        const ssize_t got = ::read(descriptor, text.data() + held, block);
        if (got < 0) {
            if (errno == EINTR)
                continue;
            return false;
        }
        left -= got;
        if (left < 0 || (got == 0 && left != 0)) {
            errno = ESTALE;
            return false;
        }
        held += static_cast<std::size_t>(got);
        const std::string_view all(text.data(), held);
        if (got == 0) {
            statements.feed(all, slack);
            break;
        }
        const std::size_t end = last_line_end(all.substr(looked_at));
        if (end == 0) {
            looked_at = held;
            continue;
        }
        const std::size_t whole = looked_at + end;
        statements.feed(all.substr(0, whole), slack);
        std::memmove(text.data(), text.data() + whole, held - whole);
        held -= whole;
        looked_at = 0;
    }
    out = statements.finish();
    return true;
}

} // namespace paradize::obj
