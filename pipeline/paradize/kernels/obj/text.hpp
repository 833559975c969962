// The text of an OBJ file as statements see it: blanks, tokens, continued lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace paradize::obj {

// A place in a text. LF, CR and CRLF end lines; a backslash before the end of a line continues it.
class Text {
  protected:
    bool at_line_end() const { return p_ == end_ || *p_ == '\n' || *p_ == '\r'; }

    // Length of a continued line's end at `q`: a backslash, blanks that editors left behind, and the line
    // break.
    std::size_t continuation(const char *q) const {
        if (q == end_ || *q != '\\')
            return 0;
        const char *r = q + 1;
        while (r != end_ && (*r == ' ' || *r == '\t'))
            ++r;
        if (r == end_ || (*r != '\n' && *r != '\r'))
            return 0;
        r += *r == '\r' && r + 1 != end_ && r[1] == '\n' ? 2 : 1;
        return static_cast<std::size_t>(r - q);
    }

    void skip_blanks() {
        while (p_ != end_) {
            if (*p_ == ' ' || *p_ == '\t' || *p_ == '\v' || *p_ == '\f') {
                ++p_;
            } else if (const std::size_t n = continuation(p_)) {
                p_ += n;
                ++continued_;
            } else {
                return;
            }
        }
    }

    // Moves to the next token; false at the end of the statement (end of line or comment).
    bool more() {
        skip_blanks();
        return !at_line_end() && *p_ != '#';
    }

    bool at_token_end() const {
        return at_line_end() || *p_ == ' ' || *p_ == '\t' || *p_ == '\v' || *p_ == '\f' ||
               continuation(p_) > 0;
    }

    std::string_view token() {
        const char *const start = p_;
        while (!at_token_end())
            ++p_;
        return {start, static_cast<std::size_t>(p_ - start)};
    }

    // The rest of the line without blanks at either end: names may hold blanks and '#'.
    std::string_view rest() {
        skip_blanks();
        const char *const start = p_;
        while (!at_line_end())
            ++p_;
        const char *stop = p_;
        while (stop != start && (stop[-1] == ' ' || stop[-1] == '\t'))
            --stop;
        return {start, static_cast<std::size_t>(stop - start)};
    }

    void finish_line() {
        while (true) {
            while (!at_line_end() && *p_ != '\\')
                ++p_;
            if (p_ == end_ || *p_ != '\\')
                break;
            const std::size_t n = comment_ ? 0 : continuation(p_);
            p_ += n ? n : 1;
            continued_ += n ? 1 : 0;
        }
        if (p_ != end_)
            p_ += *p_ == '\r' && p_ + 1 != end_ && p_[1] == '\n' ? 2 : 1;
        line_ += 1 + continued_;
        continued_ = 0;
    }

    const char *p_ = nullptr, *end_ = nullptr;
    std::uint64_t line_ = 1, continued_ = 0; // of p_, from 1; line ends that were continued since
    bool comment_ = false;                   // no backslash counts in a comment
};

} // namespace paradize::obj
