#include "obj/statements.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "obj/number.hpp"

namespace paradize::obj {

std::string Statements::text_of(std::initializer_list<std::string_view> parts) {
    std::string out;
    for (const std::string_view part : parts)
        out.append(part);
    return out;
}

void Statements::feed(std::string_view lines, std::size_t slack) {
    plain_.forget();
    p_ = lines.data();
    end_ = p_ + lines.size();
    if (line_ == 1 && lines.starts_with("\xef\xbb\xbf"))
        p_ += 3;
    const char *const plain_end = p_ + (lines.rfind('\n', lines.size()) + 1 - (p_ - lines.data()));
    while (p_ != end_ && !full_) {
        if (p_ < plain_end && is_below_limits(lines.size()))
            p_ = plain_.read(p_, plain_end, end_ + slack, elements_, line_);
        if (p_ == end_)
            break;
        statement();
        finish_line();
    }
}

Parsed Statements::finish() {
    check_forward_references();
    out_.positions_in_file = elements_.positions.size() / 3;
    out_.faces = elements_.faces.size();
    if (elements_.colors.empty() && !painted_.empty() && painted_.size() / 4 == out_.positions_in_file)
        elements_.colors = std::move(painted_);
    else if (painted_line_)
        notes_.add("polypaint", painted_line_);
    if (out_.fault_count == 0)
        assemble(elements_, limits_, notes_, out_);
    return std::move(out_);
}

void Statements::note(std::string_view what) {
    notes_.add(what, line_);
}

void Statements::fault(std::string what) {
    fault_at(std::move(what), line_);
}

void Statements::fault_at(std::string what, std::uint64_t line) {
    if (out_.fault_count++ < limits_.max_faults)
        out_.faults.push_back({std::move(what), line});
}

std::uint32_t Statements::name(std::string_view text) {
    const auto [at, fresh] =
        name_of_.try_emplace(std::string(text), static_cast<std::uint32_t>(out_.names.size()));
    if (fresh)
        out_.names.push_back(at->first);
    return at->second;
}

void Statements::statement() {
    comment_ = false;
    skip_blanks();
    if (at_line_end())
        return;
    if (*p_ == '#') {
        comment_ = true;
        const std::string_view text = rest();
        if (text.starts_with("#MRGB "))
            polypaint(text.substr(6));
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

// ZBrush writes colours of vertices as comments: MMRRGGBB for each position, in their order, MM the mask.
void Statements::polypaint(std::string_view text) {
    painted_line_ = painted_line_ ? painted_line_ : line_;
    for (; text.size() >= 8 && painted_.size() / 4 < limits_.elements; text.remove_prefix(8)) {
        std::uint32_t code = 0;
        if (std::from_chars(text.data(), text.data() + 8, code, 16).ptr != text.data() + 8)
            return;
        const auto share = [code](int shift) { return static_cast<float>(code >> shift & 255u) / 255.0f; };
        painted_.append({share(16), share(8), share(0), 1.0f});
    }
}

void Statements::other(std::string_view word) {
    static constexpr std::string_view free_form[] = {
        "vp",   "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim",
        "hole", "scrv",   "sp",  "end",  "con",  "bzp",  "bsp",   "cdc",  "cdp",  "res"};
    static constexpr std::string_view display[] = {"mg",         "bevel",     "c_interp", "d_interp", "lod",
                                                   "shadow_obj", "trace_obj", "ctech",    "stech"};
    if (std::ranges::find(free_form, word) != std::end(free_form)) {
        note("free_form");
    } else if (word == "usemap" || word == "maplib") {
        note("texture_maps");
    } else if (std::ranges::find(display, word) == std::end(display)) {
        const std::string key = text_of({"keyword:", word.substr(0, 40)});
        note(keywords_ < limits_.max_keywords || notes_.has(key) ? key : "keywords");
        keywords_ = notes_.size();
    }
}

// Whether a word stands for a number that is none, as C libraries write it: nan, -inf, -nan(ind), 1.#QNAN ...
bool Statements::is_no_finite_number(std::string_view word) {
    word.remove_prefix(word.starts_with('-') || word.starts_with('+'));
    if (!word.empty() && word[0] <= '9' && !word.starts_with("1.#"))
        return false;
    std::string text(word.substr(0, 12));
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text == "nan" || text.starts_with("nan(") || text == "inf" || text == "infinity" ||
           text.starts_with("1.#ind") || text.starts_with("1.#inf") || text.starts_with("1.#qnan") ||
           text.starts_with("1.#snan");
}

template <typename Real>
bool Statements::number(Real &value, const char *keyword) {
    const char *const start = p_;
    NumberFault result = read_number(p_, end_, value);
    const char *const after = p_;
    if (result == NumberFault::none && at_token_end())
        return true;
    p_ = start;
    if (result == NumberFault::none && *after == '#') { // a comment, or 1.#IND
        if (!is_no_finite_number(token())) {
            p_ = after;
            return true;
        }
        result = NumberFault::not_finite;
        p_ = start;
    }
    const std::string text(token().substr(0, 40));
    const char *reason = result == NumberFault::too_large    ? " is too large for a 32-bit float in '"
                         : result == NumberFault::not_finite ? " is not a finite number in '"
                                                             : " is not a number in '";
    fault(text_of({"\"", text, "\"", reason, keyword, "'"}));
    return false;
}

void Statements::numbers(Buffer<float> &into, int least, int most, int kept, const char *keyword) {
    float values[8] = {};
    int count = 0;
    bool sound = true, finite = true;
    while (sound && count < 8 && more()) {
        const char *const start = p_;
        const bool word = is_no_finite_number(token());
        finite = finite && !word;
        if (!word) {
            p_ = start;
            sound = number(values[count], keyword);
        }
        count += sound;
    }
    if (!finite) {
        std::ranges::fill(values, 0.0f);
        note(keyword == std::string_view("vt") ? "nan_uvs" : "nan_normals");
    }
    if (sound && count < least)
        fault(text_of(
            {"'", keyword, "' needs ", std::to_string(least), " numbers, found ", std::to_string(count)}));
    if (count > most)
        note(keyword == std::string_view("vt") ? "long_vt" : "long_vn");
    into.append({values, static_cast<std::size_t>(kept)});
    limit(into.size() / static_cast<std::size_t>(kept));
}

void Statements::position() {
    double values[8] = {};
    int count = 0;
    bool sound = true, finite = true;
    while (sound && count < 8 && more()) {
        const char *const start = p_;
        const bool word = count >= 3 && is_no_finite_number(token());
        finite = finite && !word;
        if (!word) {
            p_ = start;
            sound = number(values[count], "v");
        }
        count += sound;
    }
    if (sound && count < 3)
        fault(text_of({"'v' needs 3 numbers, found ", std::to_string(count)}));
    elements_.positions.append({values, 3});
    limit(elements_.positions.size() / 3);
    if (count == 4 && values[3] != 1)
        note("weights");
    if (count == 5 || count > 7)
        note("long_v");
    if (count == 6 || count == 7) {
        if (!finite) {
            std::ranges::fill(values + 3, std::end(values), 1.0);
            note("nan_colors");
        }
        if (elements_.colors.empty())
            elements_.colors.assign((elements_.positions.size() / 3 - 1) * 4, 1.0f);
        elements_.colors.append({static_cast<float>(values[3]), static_cast<float>(values[4]),
                                 static_cast<float>(values[5]),
                                 count == 7 ? static_cast<float>(values[6]) : 1.0f});
    } else if (!elements_.colors.empty()) {
        elements_.colors.append({1.0f, 1.0f, 1.0f, 1.0f});
    }
}

void Statements::smoothing() {
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

void Statements::set(std::uint32_t &field, std::uint32_t value) {
    field = value;
    elements_.new_run = true;
}

std::string_view Statements::token_or_empty() {
    return more() ? token() : std::string_view();
}

void Statements::limit(std::uint64_t count) {
    if (count == limits_.elements) {
        fault(text_of({"more than ", std::to_string(limits_.elements), " elements of one kind"}));
        p_ = end_;
        full_ = true;
    }
}

// Whether `bytes` more of text can reach no limit: an element takes two bytes at least.
bool Statements::is_below_limits(std::size_t bytes) const {
    const std::size_t most = std::max({elements_.positions.size() / 3, elements_.uvs.size() / 2,
                                       elements_.normals.size() / 3, elements_.corners.size()});
    return most + bytes / 2 < limits_.elements && line_ + bytes < absent;
}

} // namespace paradize::obj
