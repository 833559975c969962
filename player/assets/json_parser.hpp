#pragma once
// Part of json_tree.cpp.

#include "assets/json_tree.hpp"
#include "error.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <system_error>

namespace paradize::assets {

inline constexpr int max_json_depth = 256;
inline constexpr std::size_t few_members = 16; // up to this number members are searched one after another

inline bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// Appends a code point in UTF-8.
inline void append_utf8(std::string &out, std::uint32_t code) {
    const auto put = [&](std::uint32_t byte) { out += static_cast<char>(byte); };
    if (code < 0x80) {
        put(code);
    } else if (code < 0x800) {
        put(0xC0 | code >> 6U);
        put(0x80 | (code & 0x3FU));
    } else if (code < 0x10000) {
        put(0xE0 | code >> 12U);
        put(0x80 | (code >> 6U & 0x3FU));
        put(0x80 | (code & 0x3FU));
    } else {
        put(0xF0 | code >> 18U);
        put(0x80 | (code >> 12U & 0x3FU));
        put(0x80 | (code >> 6U & 0x3FU));
        put(0x80 | (code & 0x3FU));
    }
}

/// Returns the bytes of the UTF-8 sequence at the start of `text`, or 0 if there is none. The Unicode
/// Consortium, "The Unicode Standard", table 3-7.
inline std::size_t utf8_length(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
    };
    const auto within = [&](std::size_t i, unsigned low, unsigned high) {
        return byte(i) >= low && byte(i) <= high;
    };
    const unsigned lead = byte(0);
    if (lead < 0x80) {
        return 1;
    }
    if (lead >= 0xC2 && lead <= 0xDF) {
        return within(1, 0x80, 0xBF) ? 2 : 0;
    }
    if (lead >= 0xE0 && lead <= 0xEF) {
        const unsigned low = lead == 0xE0 ? 0xA0 : 0x80;  // else a shorter sequence would do
        const unsigned high = lead == 0xED ? 0x9F : 0xBF; // else it is half a surrogate pair
        return within(1, low, high) && within(2, 0x80, 0xBF) ? 3 : 0;
    }
    if (lead >= 0xF0 && lead <= 0xF4) {
        const unsigned low = lead == 0xF0 ? 0x90 : 0x80;
        const unsigned high = lead == 0xF4 ? 0x8F : 0xBF;
        return within(1, low, high) && within(2, 0x80, 0xBF) && within(3, 0x80, 0xBF) ? 4 : 0;
    }
    return 0;
}

/// Reads a document into a tree.
class JsonParser {
  public:
    JsonParser(std::string_view text, JsonTree &tree)
        : begin_(text.data()), at_(begin_), end_(begin_ + text.size()), tree_(tree) {}

    void parse() {
        // No more than these, so that the array of nodes never moves.
        tree_.nodes_.reserve(static_cast<std::size_t>(
            std::count_if(begin_, end_, [](char c) { return c == ',' || c == '[' || c == '{'; })));
        open_.reserve(64);
        tree_.root_ = value(0);
        skip_space();
        if (at_ != end_) {
            fail("nothing may follow the document");
        }
    }

  private:
    [[noreturn]] void fail(const std::string &what) const {
        const auto line = 1 + std::count(begin_, at_, '\n');
        const char *start = at_;
        while (start != begin_ && start[-1] != '\n') {
            --start;
        }
        throw Error(tree_.file_ + ": is not valid JSON: parse error at line " + std::to_string(line) +
                    ", column " + std::to_string(at_ - start + 1) + ": " + what);
    }

    void skip_space() {
        while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) {
            ++at_;
        }
    }

    /// Takes the character if it is the next one.
    bool take(char expected) {
        skip_space();
        const bool is_next = at_ != end_ && *at_ == expected;
        at_ += is_next ? 1 : 0;
        return is_next;
    }

    JsonNode value(int depth) {
        skip_space();
        if (at_ == end_) {
            fail("the text ends where a value must stand");
        }
        JsonNode out;
        switch (*at_) {
        case '{':
        case '[':
            return container(depth + 1);
        case '"':
            out.kind = JsonKind::string;
            out.text = string();
            return out;
        case 't':
        case 'f':
            out.kind = JsonKind::boolean;
            out.truth = *at_ == 't';
            word(out.truth ? "true" : "false");
            return out;
        case 'n':
            word("null");
            return out;
        default:
            out.kind = JsonKind::number;
            out.number = number();
            return out;
        }
    }

    [[noreturn]] void fail_of_value() const {
        fail("must be null, true, false, a number, a string, an array or an object");
    }

    void word(std::string_view expected) {
        if (!std::string_view(at_, static_cast<std::size_t>(end_ - at_)).starts_with(expected)) {
            fail_of_value();
        }
        at_ += expected.size();
    }

    JsonNode container(int depth) {
        if (depth > max_json_depth) {
            fail("nests deeper than " + std::to_string(max_json_depth) + " arrays and objects");
        }
        JsonNode out;
        out.kind = *at_ == '{' ? JsonKind::object : JsonKind::array;
        const char close = *at_++ == '{' ? '}' : ']';
        const std::size_t start = open_.size();
        if (!take(close)) {
            do {
                std::string_view key;
                if (close == '}') {
                    skip_space();
                    if (at_ == end_ || *at_ != '"') {
                        fail("a key must be a string");
                    }
                    key = string();
                    if (!take(':')) {
                        fail("a colon must follow a key");
                    }
                }
                open_.push_back(value(depth));
                open_.back().key = key;
            } while (take(','));
            if (!take(close)) {
                fail(std::string("a comma or ") + close + " must follow a value");
            }
        }
        out.children = {static_cast<std::uint32_t>(tree_.nodes_.size()),
                        static_cast<std::uint32_t>(open_.size() - start)};
        const auto first = open_.begin() + static_cast<std::ptrdiff_t>(start);
        if (close == '}') {
            check_keys({first, open_.end()});
        }
        tree_.nodes_.insert(tree_.nodes_.end(), first, open_.end());
        open_.erase(first, open_.end());
        return out;
    }

    /// Sorts many members. Throws Error if two have the same key.
    void check_keys(std::span<JsonNode> members) const {
        const auto refuse = [&](std::string_view key) {
            throw Error(tree_.file_ + ": key \"" + std::string(key) + "\" appears twice in one object");
        };
        if (members.size() > few_members) {
            std::ranges::sort(members, {}, &JsonNode::key);
            const auto twice = std::ranges::adjacent_find(members, {}, &JsonNode::key);
            if (twice != members.end()) {
                refuse(twice->key);
            }
            return;
        }
        for (std::size_t i = 1; i < members.size(); ++i) {
            for (std::size_t k = 0; k < i; ++k) {
                if (members[i].key == members[k].key) {
                    refuse(members[i].key);
                }
            }
        }
    }

    /// Digits up to the next other character, as part of a mantissa of at most 19 digits.
    int digits(std::uint64_t &mantissa) {
        if (at_ == end_ || !is_digit(*at_)) {
            fail("a digit must stand here");
        }
        const char *const first = at_;
        for (; at_ != end_ && is_digit(*at_); ++at_) {
            mantissa = 10 * mantissa + static_cast<std::uint64_t>(*at_ - '0'); // wraps in long numbers
        }
        return static_cast<int>(std::min<std::ptrdiff_t>(at_ - first, 1000));
    }

    double number() {
        const char *const first = at_;
        const bool negative = *at_ == '-';
        at_ += negative ? 1 : 0;
        if (at_ == end_ || !is_digit(*at_)) {
            fail_of_value();
        }
        std::uint64_t mantissa = 0;
        const bool leading_zero = *at_ == '0';
        int count = digits(mantissa);
        if (leading_zero && count > 1) {
            fail("a number must not begin with 0");
        }
        long long exponent = 0;
        if (at_ != end_ && *at_ == '.') {
            ++at_;
            const int after = digits(mantissa);
            count += after;
            exponent -= after;
        }
        if (at_ != end_ && (*at_ == 'e' || *at_ == 'E')) {
            ++at_;
            const bool down = at_ != end_ && *at_ == '-';
            at_ += at_ != end_ && (*at_ == '-' || *at_ == '+') ? 1 : 0;
            std::uint64_t power = 0;
            exponent += digits(power) > 9 ? 1'000'000 : (down ? -1 : 1) * static_cast<long long>(power);
        }
        // Both factors are exact, so that one rounding gives the nearest double: W. Clinger, "How to Read
        // Floating Point Numbers Accurately", PLDI 1990.
        if (count <= 19 && mantissa <= std::uint64_t{1} << 53U && exponent >= -22 && exponent <= 22) {
            static constexpr std::array<double, 23> powers{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                           1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                           1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
            const double whole = static_cast<double>(mantissa);
            const double size = exponent < 0 ? whole / powers[static_cast<std::size_t>(-exponent)]
                                             : whole * powers[static_cast<std::size_t>(exponent)];
            return negative ? -size : size;
        }
        double out = 0.0;
        if (std::from_chars(first, at_, out).ec == std::errc::result_out_of_range) {
            out = std::strtod(std::string(first, at_).c_str(), nullptr); // 0 where it is too small
        }
        if (!std::isfinite(out)) {
            at_ = first;
            fail("no double is as large as this number");
        }
        return out;
    }

    /// The string at the next character, a quotation mark.
    std::string_view string() {
        const char *const first = ++at_;
        skip_plain();
        if (at_ != end_ && *at_ == '"') {
            return {first, static_cast<std::size_t>(at_++ - first)};
        }
        std::string &out = tree_.unescaped_.emplace_back(first, at_);
        while (true) {
            if (at_ == end_) {
                fail("the text ends within a string");
            }
            if (*at_ == '"') {
                ++at_;
                return out;
            }
            if (*at_ != '\\') {
                fail("a control character stands in a string");
            }
            ++at_;
            append_escaped(out);
            const char *const more = at_;
            skip_plain();
            out.append(more, at_);
        }
    }

    /// Goes to the next quotation mark, backslash, control character or end.
    void skip_plain() {
        while (at_ != end_) {
            const auto c = static_cast<unsigned char>(*at_);
            if (c < 0x20 || c == '"' || c == '\\') {
                return;
            }
            if (c < 0x80) {
                ++at_;
                continue;
            }
            const std::size_t length = utf8_length({at_, static_cast<std::size_t>(end_ - at_)});
            if (length == 0) {
                fail("a string is not UTF-8");
            }
            at_ += length;
        }
    }

    void append_escaped(std::string &out) {
        constexpr std::string_view names = "\"\\/bfnrt";
        constexpr std::string_view meant = "\"\\/\b\f\n\r\t";
        if (at_ == end_) {
            fail("the text ends within a string");
        }
        if (const std::size_t name = names.find(*at_); name != std::string_view::npos) {
            out += meant[name];
            ++at_;
            return;
        }
        if (*at_ != 'u') {
            fail("a backslash must precede one of \" \\ / b f n r t u");
        }
        ++at_;
        std::uint32_t code = four_hex_digits();
        if (code >= 0xD800 && code < 0xDC00 && end_ - at_ >= 6 && at_[0] == '\\' && at_[1] == 'u') {
            at_ += 2;
            const std::uint32_t low = four_hex_digits();
            if (low >= 0xDC00 && low < 0xE000) {
                append_utf8(out, 0x10000 + ((code - 0xD800) << 10U) + (low - 0xDC00));
                return;
            }
        }
        if (code >= 0xD800 && code < 0xE000) {
            fail("half a surrogate pair stands alone");
        }
        append_utf8(out, code);
    }

    std::uint32_t four_hex_digits() {
        std::uint32_t code = 0;
        if (end_ - at_ < 4 || std::from_chars(at_, at_ + 4, code, 16).ptr != at_ + 4) {
            fail("four hexadecimal digits must follow \\u");
        }
        at_ += 4;
        return code;
    }

    const char *begin_, *at_, *end_;
    JsonTree &tree_;
    std::vector<JsonNode> open_; // the children so far of the containers that are not closed
};

} // namespace paradize::assets
