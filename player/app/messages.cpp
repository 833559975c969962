#include "app/messages.hpp"

#include "error.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace paradize {

namespace {

/// Returns the length of the UTF-8 sequence at the start of the text, or 0 if it is not valid. Surrogates and
/// overlong sequences are not valid.
std::size_t sequence(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
    };
    const unsigned first = byte(0);
    std::size_t length = 1;
    if (first >= 0x80U) {
        length = first >= 0xC2U && first <= 0xDFU ? 2 : first >= 0xE0U && first <= 0xEFU ? 3 : 4;
        if (first < 0xC2U || first > 0xF4U) {
            return 0;
        }
    }
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xC0U) != 0x80U) {
            return 0;
        }
    }
    const unsigned second = byte(1);
    const bool overlong = (first == 0xE0U && second < 0xA0U) || (first == 0xF0U && second < 0x90U);
    const bool beyond = (first == 0xEDU && second > 0x9FU) || (first == 0xF4U && second > 0x8FU);
    return overlong || beyond ? 0 : length;
}

std::uint32_t code_point(std::string_view sequence) {
    if (sequence.size() == 1) {
        return static_cast<unsigned char>(sequence[0]);
    }
    std::uint32_t out = static_cast<unsigned char>(sequence[0]) & (0x7FU >> sequence.size());
    for (const char next : sequence.substr(1)) {
        out = out << 6U | (static_cast<unsigned char>(next) & 0x3FU);
    }
    return out;
}

/// True for control characters but tabs and line feeds, line separators, direction marks and characters
/// without a glyph. The pipeline's errors.py has the same list, with these two.
bool is_invisible(std::uint32_t code) {
    struct Range {
        std::uint32_t first, last;
    };
    constexpr std::array<Range, 14> ranges{{{0x00, 0x08},
                                            {0x0B, 0x1F},
                                            {0x7F, 0x9F},
                                            {0xAD, 0xAD},
                                            {0x061C, 0x061C},
                                            {0x180E, 0x180E},
                                            {0x200B, 0x200F},
                                            {0x2028, 0x202E},
                                            {0x2060, 0x206F},
                                            {0xFE00, 0xFE0F},
                                            {0xFEFF, 0xFEFF},
                                            {0xFFF9, 0xFFFB},
                                            {0x1D173, 0x1D17A},
                                            {0xE0000, 0xE0FFF}}};
    for (const Range &range : ranges) {
        if (code >= range.first && code <= range.last) {
            return true;
        }
    }
    return false;
}

/// Names of a hostile file may be as long as the file: a message keeps its beginning and its end.
std::string bounded(std::string_view text) {
    constexpr std::size_t most = 8000; // as MOST_LINE of the pipeline
    constexpr std::string_view gap = " ... ";
    if (text.size() <= most) {
        return std::string(text);
    }
    constexpr std::size_t kept = (most - gap.size()) / 2;
    return std::string(text.substr(0, kept)).append(gap).append(text.substr(text.size() - kept));
}

std::string escaped(const char *pattern, std::uint32_t value) {
    std::array<char, 16> out{};
    std::snprintf(out.data(), out.size(), pattern, value);
    return out.data();
}

} // namespace

std::string printable(std::string_view text) {
    std::string out;
    while (!text.empty()) {
        const std::size_t length = sequence(text);
        const std::string_view one = text.substr(0, length == 0 ? 1 : length);
        const std::uint32_t code = code_point(one);
        if (length == 0 || (length == 1 && is_invisible(code))) {
            out += escaped("\\x%02X", static_cast<unsigned char>(one[0]));
        } else if (is_invisible(code)) {
            out += escaped("\\u{%X}", code);
        } else {
            out += one;
        }
        text.remove_prefix(one.size());
    }
    return out;
}

void log_message(std::string_view text) {
    std::string out = "paradize-player: ";
    for (const char c : printable(bounded(printable(text)))) { // a cut may lie inside a character
        out += c;
        if (c == '\n') {
            out += "  ";
        }
    }
    out += '\n';
    std::fputs(out.c_str(), stderr);
}

void log_progress(std::size_t drawn, std::size_t frames, double left_s) {
    const long long left = std::llround(left_s);
    std::fprintf(stderr, "paradize-player: %zu of %zu frames drawn, %lld:%02lld left\n", drawn, frames,
                 left / 60, left % 60);
}

void print(const std::string &text) {
    if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0) {
        throw Error(std::string("standard output: cannot write: ") + std::strerror(errno));
    }
}

} // namespace paradize
