#include "obj_parse.hpp"

#include <algorithm>
#include <charconv>
#include <unordered_map>

#include "obj_assemble.hpp"
#include "obj_number.hpp"

namespace paradize::obj {
namespace {

std::string text_of(std::initializer_list<std::string_view> parts) {
    std::string out;
    for (const std::string_view part : parts)
        out.append(part);
    return out;
}

constexpr const char *index_words[3] = {"position", "texture coordinate", "normal"};

class Parser {
  public:
    Parser(std::string_view text, const Limits &limits)
        : p_(text.data()), end_(p_ + text.size()), limits_(limits) {
        if (text.starts_with("\xef\xbb\xbf"))
            p_ += 3;
    }

    Parsed run() {
        while (p_ != end_) {
            statement();
            finish_line();
        }
        check_forward_references();
        out_.positions_in_file = elements_.positions.size() / 3;
        out_.uvs_in_file = elements_.uvs.size() / 2;
        out_.normals_in_file = elements_.normals.size() / 3;
        if (out_.fault_count == 0)
            assemble(elements_, limits_, notes_, out_);
        return std::move(out_);
    }

  private:
    // --- text
    // ---------------------------------------------------------------------------------------------------
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
            state_.group = name(rest());
        else if (word == "o")
            state_.object = name(rest());
        else if (word == "usemtl")
            state_.material = name(rest());
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
    void numbers(std::vector<float> &into, int least, int most, int kept, const char *keyword) {
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
        into.insert(into.end(), values, values + kept);
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
        elements_.positions.insert(elements_.positions.end(), values, values + 3);
        limit(elements_.positions.size() / 3);
        if (count == 4 && values[3] != 1)
            note("weights");
        if (count == 5 || count > 7)
            note("long_v");
        if (count == 6 || count == 7) {
            if (elements_.colors.empty())
                elements_.colors.assign((elements_.positions.size() / 3 - 1) * 4, 1.0f);
            elements_.colors.insert(elements_.colors.end(),
                                    {values[3], values[4], values[5], count == 7 ? values[6] : 1.0f});
        } else if (!elements_.colors.empty()) {
            elements_.colors.insert(elements_.colors.end(), 4, 1.0f);
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
        state_.smoothing = group;
    }

    std::string_view token_or_empty() { return more() ? token() : std::string_view(); }

    void limit(std::uint64_t count) {
        if (count == limits_.elements) {
            fault(text_of({"more than ", std::to_string(limits_.elements), " elements of one kind"}));
            p_ = end_;
        }
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
            if (!corner(c))
                return;
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
        elements_.faces.push_back({static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count),
                                   static_cast<std::uint32_t>(std::min<std::uint64_t>(line_, absent))});
        out_.faces += 1;
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

    const char *p_;
    const char *const end_;
    const Limits limits_;
    std::uint64_t line_ = 1, continued_ = 0, keywords_ = 0;
    bool comment_ = false;
    Elements elements_;
    Run state_{0, absent, absent, absent, absent};
    std::pair<std::int64_t, std::uint64_t> furthest_[3] = {};
    std::unordered_map<std::string, std::uint32_t> name_of_;
    Parsed out_;
    Notes notes_{out_.notes};
};

} // namespace

Parsed parse(std::string_view text, const Limits &limits) {
    return Parser(text, limits).run();
}

} // namespace paradize::obj
