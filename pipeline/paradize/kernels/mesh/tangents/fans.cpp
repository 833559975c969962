#include "mesh/tangents/fans.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "mesh/tangents/frame.hpp"

namespace paradize::mesh {
namespace {

constexpr std::uint32_t no_corner = 0xffffffffu;
// Groups larger than this are averaged whole: comparing all pairs of their faces would be quadratic.
constexpr std::size_t largest_compared_group = 256;
constexpr std::size_t largest_quick_fan = 16;
// A sum this small beside its largest part (squared) is rounding alone.
constexpr double no_direction = 1e-13;

Vec vec(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

Vec normal_of(const Fans &fans, std::uint32_t vertex) {
    return unit(at3(fans.surface.normals, fans.welded.first[vertex]));
}

// The fan of a vertex whose corners are one group without opposite directions, the common case. False:
// another case, or not surely this one.
bool quick(const Fans &fans, std::uint32_t vertex, Frame &frame) {
    const std::uint32_t *const corners = fans.corner.data() + fans.start[vertex];
    const std::size_t size = fans.start[vertex + 1] - fans.start[vertex];
    if (size > largest_quick_fan)
        return false;
    const Face *face[largest_quick_fan];
    const float *pull[largest_quick_fan];
    std::uint32_t out[largest_quick_fan], in[largest_quick_fan];
    Vec sum;
    std::uint32_t any = 0, all = ~0u;
    for (std::size_t i = 0; i < size; ++i) {
        const std::uint32_t f = corners[i] / 3, k = corners[i] - f * 3;
        face[i] = &fans.faces[f];
        pull[i] = face[i]->pull[k];
        out[i] = face[i]->vertex[k == 2 ? 0 : k + 1];
        in[i] = face[i]->vertex[k == 0 ? 2 : k - 1];
        any |= face[i]->flags;
        all &= face[i]->flags;
        sum = sum + Vec{pull[i][0], pull[i][1], pull[i][2]};
    }
    if (any != all || (any & (face_any | face_flat)) != 0)
        return false;
    // Faces that follow one another around the vertex; all in one chain or ring?
    std::uint32_t next[largest_quick_fan] = {}, reached = 0, links = 0;
    for (std::size_t i = 0; i < size; ++i) {
        std::uint32_t mask = 0;
        for (std::size_t j = 0; j < size; ++j)
            mask |= static_cast<std::uint32_t>(in[j] == out[i]) << j;
        if ((mask & (mask - 1)) != 0 || (mask & reached) != 0)
            return false; // three faces or more at an edge
        reached |= mask;
        links += mask != 0;
        next[i] = mask != 0 ? static_cast<std::uint32_t>(std::countr_zero(mask)) : no_corner;
    }
    if (links + 1 < size)
        return false;
    const auto head = links == size ? 0u : static_cast<std::uint32_t>(std::countr_one(reached));
    std::size_t passed = 1;
    for (std::uint32_t i = next[head]; i != no_corner && i != head; i = next[i])
        ++passed;
    if (passed != size)
        return false;
    const float *const given = &fans.surface.normals[fans.welded.first[vertex] * std::size_t{3}];
    Vec n{given[0], given[1], given[2]};
    const double nn = dot(n, n);
    if (!(nn > 0))
        return false;
    n = (1 / std::sqrt(nn)) * n;
    sum = sum - dot(n, sum) * n;
    const double ss = dot(sum, sum);
    if (!(ss > 1e-6)) // radians
        return false;
    const Vec t = (1 / std::sqrt(ss)) * sum;
    // If all u directions lie well on one side, no two of them are opposite; the same for v.
    const Vec b = cross(n, t);
    const double side = dot(vec(face[0]->down), b) < 0 ? -1 : 1;
    bool one_side = true;
    for (std::size_t i = 0; i < size; ++i) {
        const Vec p{pull[i][0], pull[i][1], pull[i][2]};
        const double along = dot(p, t);
        one_side &=
            (along > 0) & (along * along > 1e-6 * dot(p, p)) & (side * dot(vec(face[i]->down), b) > 1e-3);
    }
    frame = {static_cast<float>(t.x), static_cast<float>(t.y), static_cast<float>(t.z),
             sign_of((any & face_preserves) != 0)};
    return one_side;
}

// A fan of any kind.
struct Fan {
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> after,
        before;                       // the corner across the edge that leaves the vertex, that ends there
    std::vector<std::uint32_t> group; // of each corner, or no_corner
    std::vector<bool> preserves;      // of each group

    void read(const Fans &fans, std::uint32_t vertex) {
        corners.assign(fans.corner.data() + fans.start[vertex], fans.corner.data() + fans.start[vertex + 1]);
        after.assign(corners.size(), no_corner);
        before.assign(corners.size(), no_corner);
        group.assign(corners.size(), no_corner);
        preserves.clear();
        // Along an edge the first face that runs to it with the first that runs from it, and so on.
        std::vector<std::pair<std::uint32_t, std::uint32_t>> out, in;
        for (std::uint32_t i = 0; i < corners.size(); ++i) {
            const Face &face = fans.faces[corners[i] / 3];
            if ((face.flags & face_flat) != 0)
                continue;
            out.emplace_back(face.vertex[(corners[i] + 1) % 3], i);
            in.emplace_back(face.vertex[(corners[i] + 2) % 3], i);
        }
        std::ranges::sort(out);
        std::ranges::sort(in);
        for (std::size_t i = 0, j = 0; i < out.size() && j < in.size();) {
            if (out[i].first == in[j].first) {
                after[out[i].second] = in[j].second;
                before[in[j].second] = out[i].second;
            }
            const bool step_i = out[i].first <= in[j].first, step_j = in[j].first <= out[i].first;
            i += step_i;
            j += step_j;
        }
    }
};

bool seeds(const Fans &fans, const Fan &fan, std::uint32_t i) {
    const std::uint32_t flags = fans.faces[fan.corners[i] / 3].flags;
    return (flags & (face_any | face_flat)) == 0 && fan.group[i] == no_corner;
}

// Corners joined by edges to corner `from`, with the same handedness. `fixed` tells of faces that follow
// their neighbours whether a group has taken them already; the first that does gives them its handedness.
void grow(const Fans &fans, Fan &fan, std::uint32_t from, std::vector<bool> *fixed) {
    const bool preserves = (fans.faces[fan.corners[from] / 3].flags & face_preserves) != 0;
    const auto number = static_cast<std::uint32_t>(fan.preserves.size());
    fan.preserves.push_back(preserves);
    std::vector<std::uint32_t> open{from};
    while (!open.empty()) {
        const std::uint32_t i = open.back();
        open.pop_back();
        if (i == no_corner || fan.group[i] != no_corner)
            continue;
        const std::uint32_t f = fan.corners[i] / 3;
        std::uint32_t &flags = fans.faces[f].flags;
        if (fixed && (flags & face_any) != 0 && !(*fixed)[f]) {
            (*fixed)[f] = true;
            flags = (flags & ~face_preserves) | (preserves ? face_preserves : 0u);
        }
        if (((flags & face_preserves) != 0) != preserves)
            continue;
        fan.group[i] = number;
        open.push_back(fan.after[i]);
        open.push_back(fan.before[i]);
    }
}

// One group's frames, into the places of `frames` that its corners have in the fan.
void evaluate(const Fans &fans, const Fan &fan, std::uint32_t number, Vec n, std::vector<Frame> &frames) {
    std::vector<std::uint32_t> members;
    std::vector<Vec> pull, s, t;
    for (std::uint32_t i = 0; i < fan.corners.size(); ++i) {
        if (fan.group[i] != number)
            continue;
        const Face &face = fans.faces[fan.corners[i] / 3];
        members.push_back(i);
        pull.push_back(vec(face.pull[fan.corners[i] % 3]));
        s.push_back(unit(pull.back()));
        t.push_back(on_plane(vec(face.down), n));
    }
    // Faces whose directions are opposite do not share a frame. All others do.
    const auto opposite = [&](std::size_t i, std::size_t j) {
        return static_cast<float>(dot(s[i], s[j])) <= -1.0f || static_cast<float>(dot(t[i], t[j])) <= -1.0f;
    };
    const std::size_t size = members.size();
    bool together = true;
    if (size <= largest_compared_group)
        for (std::size_t i = 0; i < size && together; ++i)
            for (std::size_t j = i + 1; j < size && together; ++j)
                together = !opposite(i, j);
    Vec shared;
    for (std::size_t i = 0; i < size; ++i) {
        if (i == 0 || !together) {
            double largest = 0;
            shared = {};
            for (std::size_t j = 0; j < size; ++j)
                if (together || i == j || !opposite(i, j)) {
                    shared = shared + pull[j];
                    largest = std::max(largest, dot(pull[j], pull[j]));
                }
            if (!(dot(shared, shared) > no_direction * largest))
                shared = {};
        }
        frames[members[i]] = frame_of(shared, n, sign_of(fan.preserves[number]));
    }
}

// All groups' frames. Corners in no group, of faces without area, take the frame of the first that is in one.
void finish(const Fans &fans, const Fan &fan, std::uint32_t vertex, Frame *frames,
            std::vector<CornerFrame> &odd) {
    if (fan.corners.empty())
        return;
    const Vec n = normal_of(fans, vertex);
    std::vector<Frame> found(fan.corners.size());
    for (std::uint32_t g = 0; g < fan.preserves.size(); ++g)
        evaluate(fans, fan, g, n, found);
    const auto donor = std::ranges::find_if(fan.group, [](std::uint32_t g) { return g != no_corner; });
    const Frame lent = donor == fan.group.end() ? frame_of({}, n, 1)
                                                : found[static_cast<std::size_t>(donor - fan.group.begin())];
    for (std::size_t i = 0; i < found.size(); ++i)
        if (fan.group[i] == no_corner)
            found[i] = lent;
    frames[vertex] = found[0];
    if (std::ranges::all_of(found, [&](const Frame &frame) { return frame == found[0]; }))
        return;
    frames[vertex].w = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
        odd.push_back({fan.corners[i], found[i]});
}

} // namespace

Fans::Fans(const Surface &given, const Welded &joined, Buffer<Face> &measured)
    : surface(given), welded(joined), faces(measured), start(joined.count + 2), corner(measured.size() * 3) {
    // start[v + 2] counts, then start[v + 1] is where v's next corner goes, and in the end where v's end.
    std::fill_n(start.data(), start.size(), 0u);
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (const std::uint32_t v : faces[f].vertex)
            ++start[v + std::size_t{2}];
    for (std::size_t v = 2; v < start.size(); ++v)
        start[v] += start[v - 1];
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (std::size_t k = 0; k < 3; ++k)
            corner[start[faces[f].vertex[k] + std::size_t{1}]++] = static_cast<std::uint32_t>(f * 3 + k);
}

void gather_frames(const Fans &fans, std::size_t first, std::size_t last, Frame *frames, FanFrames &found) {
    Fan fan;
    for (std::size_t v = first; v < last; ++v) {
        const auto vertex = static_cast<std::uint32_t>(v);
        if (quick(fans, vertex, frames[v]))
            continue;
        bool decided = true;
        for (std::uint32_t at = fans.start[v]; at < fans.start[v + 1]; ++at)
            decided &= (fans.faces[fans.corner[at] / 3].flags & face_any) == 0;
        if (!decided) {
            found.undecided.push_back(vertex);
            continue;
        }
        fan.read(fans, vertex);
        for (std::uint32_t i = 0; i < fan.corners.size(); ++i)
            if (seeds(fans, fan, i))
                grow(fans, fan, i, nullptr);
        finish(fans, fan, vertex, frames, found.odd);
    }
}

void decide_frames(const Fans &fans, const std::vector<std::uint32_t> &vertices, Frame *frames,
                   std::vector<CornerFrame> &odd) {
    struct Seed {
        std::uint32_t corner, fan, place;
    };
    std::vector<Fan> around(vertices.size());
    std::vector<Seed> order;
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
        around[i].read(fans, vertices[i]);
        for (std::uint32_t k = 0; k < around[i].corners.size(); ++k)
            if (seeds(fans, around[i], k))
                order.push_back({around[i].corners[k], i, k});
    }
    std::ranges::sort(order, {}, &Seed::corner);
    std::vector<bool> fixed(vertices.empty() ? 0 : fans.faces.size());
    for (const Seed &seed : order)
        if (seeds(fans, around[seed.fan], seed.place))
            grow(fans, around[seed.fan], seed.place, &fixed);
    for (std::size_t i = 0; i < vertices.size(); ++i)
        finish(fans, around[i], vertices[i], frames, odd);
}

} // namespace paradize::mesh
