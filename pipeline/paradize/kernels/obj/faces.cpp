#include <algorithm>
#include <charconv>

#include "obj/statements.hpp"

namespace paradize::obj {
namespace {

// A texture coordinate or normal that is not there, until `drop_broken_references` counts it.
constexpr std::uint32_t broken = absent - 1;

} // namespace

std::string Statements::out_of_range(std::int64_t given, std::uint64_t have, std::string_view where) {
    const std::string number = std::to_string(given);
    if (have == 0)
        return text_of({"position index ", number, ", but there are none", where});
    return text_of({"position index ", number, " is out of range 1 to ", std::to_string(have)});
}

bool Statements::index(Kind kind, std::uint64_t have, std::uint32_t &value) {
    std::int64_t given = 0;
    const char *from = p_ != end_ && *p_ == '+' ? p_ + 1 : p_;
    const auto [stop, error] = std::from_chars(from, end_, given);
    if (error != std::errc()) {
        fault(text_of({"\"", token().substr(0, 40), "\" is not a face corner (v, v/vt, v//vn or v/vt/vn)"}));
        return false;
    }
    p_ = stop;
    const auto there = static_cast<std::int64_t>(have);
    const std::int64_t found = given < 0 ? given + there + 1 : given;
    if (found <= 0 || found > static_cast<std::int64_t>(broken)) {
        if (kind == Kind::position) {
            fault(given < 0 && have > 0 ? text_of({"position index ", std::to_string(given),
                                                   " reaches before the first of ", std::to_string(have)})
                                        : out_of_range(given, have, " before it"));
            return false;
        }
        value = broken;
        any_broken_ = true;
        return true;
    }
    if (found > there) {
        if (kind == Kind::position && found > furthest_.first)
            furthest_ = {found, line_};
        any_broken_ = any_broken_ || kind != Kind::position;
    }
    value = static_cast<std::uint32_t>(found - 1);
    return true;
}

bool Statements::corner(Corner &c) {
    const char *const start = p_;
    if (!index(Kind::position, elements_.positions.size() / 3, c.position))
        return false;
    if (p_ != end_ && *p_ == '/') {
        ++p_;
        if (p_ != end_ && *p_ != '/' && !at_token_end() && !index(Kind::uv, elements_.uvs.size() / 2, c.uv))
            return false;
        if (p_ != end_ && *p_ == '/') {
            ++p_;
            if (!at_token_end() && !index(Kind::normal, elements_.normals.size() / 3, c.normal))
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
    const std::uint64_t have = elements_.positions.size() / 3;
    if (furthest_.first > static_cast<std::int64_t>(have))
        fault_at(out_of_range(furthest_.first, have, ""), furthest_.second);
    if (any_broken_)
        drop_broken_references();
}

void Statements::drop_broken_references() {
    const std::uint64_t uvs = elements_.uvs.size() / 2, normals = elements_.normals.size() / 3;
    Corner *corner = elements_.corners.data();
    for (std::size_t f = 0; f < elements_.faces.size(); ++f) {
        const Face face = elements_.faces[f];
        for (std::uint32_t k = 0; k < face.count; ++k, ++corner) {
            if (corner->uv != absent && corner->uv >= uvs) {
                corner->uv = absent;
                notes_.add("broken_uvs", face.line);
            }
            if (corner->normal != absent && corner->normal >= normals) {
                corner->normal = absent;
                notes_.add("broken_normals", face.line);
            }
        }
    }
}

} // namespace paradize::obj
