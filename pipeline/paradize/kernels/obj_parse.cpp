#include "obj_parse.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <unordered_map>

#include <unistd.h>

#include "obj_assemble.hpp"
#include "obj_number.hpp"
#include "obj_plain.hpp"
#include "obj_text.hpp"

namespace paradize::obj {
namespace {

std::string text_of(std::initializer_list<std::string_view> parts) {
    std::string out;
    for (const std::string_view part : parts)
        out.append(part);
    return out;
}

constexpr const char *index_words[3] = {"position", "texture coordinate", "normal"};

class Parser : Text {
  public:
    explicit Parser(const Limits &limits) : limits_(limits) {}

    // Reads whole lines; only the last of the last call may lack its end. From the end of `lines` on, `slack`
    // more bytes may be read, whatever they are.
    void feed(std::string_view lines, std::size_t slack) {
        p_ = lines.data();
        end_ = p_ + lines.size();
        if (line_ == 1 && lines.starts_with("\xef\xbb\xbf"))
            p_ += 3;
        const char *const plain_end = p_ + (lines.rfind('\n', lines.size()) + 1 - (p_ - lines.data()));
        while (p_ != end_ && !full_) {
            if (p_ < plain_end && is_below_limits(lines.size()))
                p_ = plain_lines(p_, plain_end, end_ + slack, elements_, line_);
            if (p_ == end_)
                break;
            statement();
            finish_line();
        }
    }

    Parsed finish() {
        check_forward_references();
        out_.positions_in_file = elements_.positions.size() / 3;
        out_.uvs_in_file = elements_.uvs.size() / 2;
        out_.normals_in_file = elements_.normals.size() / 3;
        out_.faces = elements_.faces.size();
        if (out_.fault_count == 0)
            assemble(elements_, limits_, notes_, out_);
        return std::move(out_);
    }

  private:
    // --- what is said
    // -------------------------------------------------------------------------------------------
    void note(std::string_view what) { notes_.add(what, line_); }

    void fault(std::string what) { fault_at(std::move(what), line_); }

    void fault_at(std::string what, std::uint64_t line) {
        if (out_.fault_count++ < limits_.told_faults)
            out_.faults.push_back({std::move(what), line});
    }

    std::uint32_t name(std::string_view text) {
        const auto [at, fresh] =
            name_of_.try_emplace(std::string(text), static_cast<std::uint32_t>(out_.names.size()));
        if (fresh)
            out_.names.push_back(at->first);
        return at->second;
    }

    // --- statements
    // ---------------------------------------------------------------------------------------------
    void statement() {
        comment_ = false;
        skip_blanks();
        if (at_line_end())
            return;
        if (*p_ == '#') {
            comment_ = true;
            return;
        }
        const std::string_view word = token();
        if (word == "v")
            position();
        else if (word == "vt")
            numbers(elements_.uvs, 1, 3, 2, "vt");
        else if (word == "vn")
            numbers(elements_.normals, 3, 3, 3, "vn");
        else if (word == "f" || word == "fo")
            face();
        else if (word == "g")
            set(state_.group, name(rest()));
        else if (word == "o")
            set(state_.object, name(rest()));
        else if (word == "usemtl")
            set(state_.material, name(rest()));
        else if (word == "mtllib")
            out_.libraries.push_back(name(rest()));
        else if (word == "s")
            smoothing();
        else if (word == "l")
            note("lines");
        else if (word == "p")
            note("points");
        else
            other(word);
    }

    void other(std::string_view word) {
        static constexpr std::string_view free_form[] = {
            "vp",   "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim",
            "hole", "scrv",   "sp",  "end",  "con",  "bzp",  "bsp",   "cdc",  "cdp",  "res"};
        static constexpr std::string_view display[] = {"mg",        "bevel",  "c_interp", "d_interp",
                                                       "lod",       "maplib", "usemap",   "shadow_obj",
                                                       "trace_obj", "ctech",  "stech"};
        if (std::ranges::find(free_form, word) != std::end(free_form)) {
            note("free_form");
        } else if (std::ranges::find(display, word) == std::end(display)) {
            const std::string key = text_of({"keyword:", word.substr(0, 40)});
            note(keywords_ < limits_.told_keywords || notes_.has(key) ? key : "keywords");
            keywords_ = notes_.size();
        }
    }

    bool number(float &value, const char *keyword) {
        const char *const start = p_;
        const NumberFault result = read_float(p_, end_, value);
        if (result == NumberFault::none && (at_token_end() || *p_ == '#'))
            return true;
        p_ = start;
        const std::string text(token().substr(0, 40));
        const char *reason = result == NumberFault::too_large    ? " is too large for a 32-bit float in '"
                             : result == NumberFault::not_finite ? " is not a finite number in '"
                                                                 : " is not a number in '";
        fault(text_of({"\"", text, "\"", reason, keyword, "'"}));
        return false;
    }

    // Reads between `least` and `most` numbers and appends `kept` of them, zeros where fewer were given.
    void numbers(Buffer<float> &into, int least, int most, int kept, const char *keyword) {
        float values[8] = {};
        int count = 0;
        bool sound = true;
        while (sound && count < 8 && more())
            if ((sound = number(values[count], keyword)))
                ++count;
        if (sound && count < least)
            fault(text_of({"'", keyword, "' needs ", std::to_string(least), " numbers, found ",
                           std::to_string(count)}));
        if (count > most)
            note(keyword == std::string_view("vt") ? "long_vt" : "long_vn");
        into.append({values, static_cast<std::size_t>(kept)});
        limit(into.size() / static_cast<std::size_t>(kept));
    }

    void position() {
        float values[8] = {};
        int count = 0;
        bool sound = true;
        while (sound && count < 8 && more())
            if ((sound = number(values[count], "v")))
                ++count;
        if (sound && count < 3)
            fault(text_of({"'v' needs 3 numbers, found ", std::to_string(count)}));
        elements_.positions.append({values, 3});
        limit(elements_.positions.size() / 3);
        if (count == 4 && values[3] != 1)
            note("weights");
        if (count == 5 || count > 7)
            note("long_v");
        if (count == 6 || count == 7) {
            if (elements_.colors.empty())
                elements_.colors.assign((elements_.positions.size() / 3 - 1) * 4, 1.0f);
            elements_.colors.append({values[3], values[4], values[5], count == 7 ? values[6] : 1.0f});
        } else if (!elements_.colors.empty()) {
            elements_.colors.append({1.0f, 1.0f, 1.0f, 1.0f});
        }
    }

    void smoothing() {
        const std::string_view word = token_or_empty();
        std::uint32_t group = 0;
        if (word == "off" || word.empty()) {
            group = 0;
        } else if (word == "on") {
            group = 1;
        } else if (std::from_chars(word.data(), word.data() + word.size(), group).ptr !=
                       word.data() + word.size() ||
                   group == absent) {
            note("smoothing");
            group = 0;
        }
        set(state_.smoothing, group);
    }

    void set(std::uint32_t &field, std::uint32_t value) {
        field = value;
        elements_.new_run = true;
    }

    std::string_view token_or_empty() { return more() ? token() : std::string_view(); }

    void limit(std::uint64_t count) {
        if (count == limits_.elements) {
            fault(text_of({"more than ", std::to_string(limits_.elements), " elements of one kind"}));
            p_ = end_;
            full_ = true;
        }
    }

    // Whether `bytes` more of text can reach no limit: an element takes two bytes at least.
    bool is_below_limits(std::size_t bytes) const {
        const std::size_t most = std::max({elements_.positions.size() / 3, elements_.uvs.size() / 2,
                                           elements_.normals.size() / 3, elements_.corners.size()});
        return most + bytes / 2 < limits_.elements && line_ + bytes < absent;
    }

    // What is wrong with an index that names none of `have`; `where` is said when there are none at all.
    static std::string out_of_range(int kind, std::int64_t given, std::uint64_t have,
                                    std::string_view where) {
        const std::string number = std::to_string(given);
        if (have == 0)
            return text_of({index_words[kind], " index ", number, ", but there are none", where});
        return text_of(
            {index_words[kind], " index ", number, " is out of range 1 to ", std::to_string(have)});
    }

    // One index of a corner: moves past it. False (and a fault) on anything but a whole number in range.
    bool index(int kind, std::uint64_t have, std::uint32_t &value) {
        std::int64_t given = 0;
        const char *from = p_ != end_ && *p_ == '+' ? p_ + 1 : p_;
        const auto [stop, error] = std::from_chars(from, end_, given);
        if (error != std::errc()) {
            fault(text_of(
                {"\"", token().substr(0, 40), "\" is not a face corner (v, v/vt, v//vn or v/vt/vn)"}));
            return false;
        }
        p_ = stop;
        if (given < 0) {
            given += static_cast<std::int64_t>(have) + 1;
            if (given <= 0) {
                given -= static_cast<std::int64_t>(have) + 1;
                fault(have == 0 ? out_of_range(kind, given, have, " before it")
                                : text_of({index_words[kind], " index ", std::to_string(given),
                                           " reaches before the first of ", std::to_string(have)}));
                return false;
            }
        } else if (given == 0 || given > static_cast<std::int64_t>(absent) - 1) {
            fault(out_of_range(kind, given, have, " before it"));
            return false;
        } else if (given > static_cast<std::int64_t>(have) && given > furthest_[kind].first) {
            furthest_[kind] = {given, line_};
        }
        value = static_cast<std::uint32_t>(given - 1);
        return true;
    }

    bool corner(Corner &c) {
        const char *const start = p_;
        if (!index(0, elements_.positions.size() / 3, c.position))
            return false;
        if (p_ != end_ && *p_ == '/') {
            ++p_;
            if (p_ != end_ && *p_ != '/' && !at_token_end() && !index(1, elements_.uvs.size() / 2, c.uv))
                return false;
            if (p_ != end_ && *p_ == '/') {
                ++p_;
                if (!at_token_end() && !index(2, elements_.normals.size() / 3, c.normal))
                    return false;
            }
        }
        if (!at_token_end() && *p_ != '#') {
            p_ = start;
            fault(text_of(
                {"\"", token().substr(0, 40), "\" is not a face corner (v, v/vt, v//vn or v/vt/vn)"}));
            return false;
        }
        return true;
    }

    void face() {
        const std::size_t first = elements_.corners.size();
        while (more()) {
            Corner c{absent, absent, absent};
            if (!corner(c)) {
                elements_.corners.resize(first);
                return;
            }
            elements_.corners.push_back(c);
            limit(elements_.corners.size());
        }
        const std::size_t count = elements_.corners.size() - first;
        if (count < 3) {
            elements_.corners.resize(first);
            note("short_faces");
            return;
        }
        if (elements_.runs.empty() || !same_state(elements_.runs.back().state, state_))
            elements_.runs.push_back({static_cast<std::uint32_t>(elements_.faces.size()), state_});
        elements_.new_run = false;
        elements_.faces.push_back({static_cast<std::uint32_t>(count),
                                   static_cast<std::uint32_t>(std::min<std::uint64_t>(line_, absent))});
    }

    static bool same_state(const Run &a, const Run &b) {
        return a.object == b.object && a.group == b.group && a.material == b.material &&
               a.smoothing == b.smoothing;
    }

    // Faces may come before what they name: the largest such index of each kind is checked at the end.
    void check_forward_references() {
        const std::uint64_t have[3] = {elements_.positions.size() / 3, elements_.uvs.size() / 2,
                                       elements_.normals.size() / 3};
        for (int kind = 0; kind < 3; ++kind)
            if (furthest_[kind].first > static_cast<std::int64_t>(have[kind]))
                fault_at(out_of_range(kind, furthest_[kind].first, have[kind], ""), furthest_[kind].second);
    }

    const Limits limits_;
    std::uint64_t keywords_ = 0;
    bool full_ = false;
    Elements elements_;
    Run state_{0, absent, absent, absent, absent};
    std::pair<std::int64_t, std::uint64_t> furthest_[3] = {};
    std::unordered_map<std::string, std::uint32_t> name_of_;
    Parsed out_;
    Notes notes_{out_.notes};
};

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
    Parser parser(limits);
    parser.feed(text, 0);
    return parser.finish();
}

bool parse_file(int descriptor, const Limits &limits, Parsed &out) {
    constexpr std::size_t block = std::size_t{256} << 10, slack = 256;
    Parser parser(limits);
    Buffer<char> text;
    std::size_t held = 0, looked_at = 0; // bytes in `text`; of them, known to hold no place to part
    while (true) {
        if (held + block > text.size())
            text.resize(std::max(held + block, 2 * held) + slack);
        const ssize_t got = ::read(descriptor, text.data() + held, block);
        if (got < 0) {
            if (errno == EINTR)
                continue;
            return false;
        }
        held += static_cast<std::size_t>(got);
        const std::string_view all(text.data(), held);
        if (got == 0) {
            parser.feed(all, slack);
            break;
        }
        const std::size_t end = last_line_end(all.substr(looked_at));
        if (end == 0) {
            looked_at = held;
            continue;
        }
        const std::size_t whole = looked_at + end;
        parser.feed(all.substr(0, whole), slack);
        std::memmove(text.data(), text.data() + whole, held - whole);
        held -= whole;
        looked_at = 0;
    }
    out = parser.finish();
    return true;
}

} // namespace paradize::obj
