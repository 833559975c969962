#include <algorithm>
#include <charconv>

#include "obj/statements.hpp"

namespace paradize::obj {
namespace {

constexpr const char *index_words[3] = {"position", "texture coordinate", "normal"};

} // namespace

std::string Statements::out_of_range(int kind, std::int64_t given, std::uint64_t have,
                                     std::string_view where) {
    const std::string number = std::to_string(given);
    if (have == 0)
        return text_of({index_words[kind], " index ", number, ", but there are none", where});
    return text_of({index_words[kind], " index ", number, " is out of range 1 to ", std::to_string(have)});
}

bool Statements::index(int kind, std::uint64_t have, std::uint32_t &value) {
    std::int64_t given = 0;
    const char *from = p_ != end_ && *p_ == '+' ? p_ + 1 : p_;
    const auto [stop, error] = std::from_chars(from, end_, given);
    if (error != std::errc()) {
        fault(text_of({"\"", token().substr(0, 40), "\" is not a face corner (v, v/vt, v//vn or v/vt/vn)"}));
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

bool Statements::corner(Corner &c) {
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
        fault(text_of({"\"", token().substr(0, 40), "\" is not a face corner (v, v/vt, v//vn or v/vt/vn)"}));
        return false;
    }
    return true;
}

void Statements::face() {
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

bool Statements::same_state(const Run &a, const Run &b) {
    return a.object == b.object && a.group == b.group && a.material == b.material &&
           a.smoothing == b.smoothing;
}

void Statements::check_forward_references() {
    const std::uint64_t have[3] = {elements_.positions.size() / 3, elements_.uvs.size() / 2,
                                   elements_.normals.size() / 3};
    for (int kind = 0; kind < 3; ++kind)
        if (furthest_[kind].first > static_cast<std::int64_t>(have[kind]))
            fault_at(out_of_range(kind, furthest_[kind].first, have[kind], ""), furthest_[kind].second);
}

} // namespace paradize::obj
