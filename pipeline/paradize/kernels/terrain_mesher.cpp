#include "terrain_mesher.hpp"

#include <algorithm>
#include <utility>

namespace paradize::terrain {
namespace {

// Positive when d lies inside the circle through a, b, c (which turn positively). Coordinates differ by at
// most 2^14, so each product is below 2^58.
std::int64_t in_circle(Spot a, Spot b, Spot c, Spot d) {
    const std::int64_t ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y, cx = c.x - d.x,
                       cy = c.y - d.y;
    return (ax * ax + ay * ay) * (bx * cy - by * cx) - (bx * bx + by * by) * (ax * cy - ay * cx) +
           (cx * cx + cy * cy) * (ax * by - ay * bx);
}

} // namespace

std::uint32_t Mesher::add_vertex(Spot spot) {
    net_.vertices.push_back(spot);
    return static_cast<std::uint32_t>(net_.vertices.size() - 1);
}

std::uint32_t Mesher::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto triangle = static_cast<std::uint32_t>(candidates_.size());
    net_.corners.insert(net_.corners.end(), {a, b, c});
    net_.twins.insert(net_.twins.end(), {none, none, none});
    candidates_.push_back(none);
    queue_.reach(candidates_.size());
    set_triangle(triangle, a, b, c);
    return triangle;
}

void Mesher::set_triangle(std::uint32_t triangle, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t e = 3 * triangle, corners[3] = {a, b, c};
    for (std::uint32_t k = 0; k < 3; ++k) {
        net_.corners[e + k] = corners[k];
        if (corners[k] < spokes_.size()) {
            spokes_[corners[k]] = e + k;
        }
    }
}

void Mesher::link(std::uint32_t edge, std::uint32_t twin) {
    net_.twins[edge] = twin;
    if (twin != none) {
        net_.twins[twin] = edge;
    }
}

void Mesher::start(const std::vector<Spot> &corners) {
    constexpr std::size_t some = 4096; // triangles: room for a tile of common ground
    net_ = {};
    net_.vertices.reserve(some / 2);
    net_.corners.reserve(3 * some);
    net_.twins.reserve(3 * some);
    candidates_.reserve(some);
    queue_.reserve(some);
    candidates_.clear();
    spokes_.assign(corners.size(), none);
    for (const Spot corner : corners) {
        add_vertex(corner);
    }
    const auto count = static_cast<std::uint32_t>(corners.size());
    for (std::uint32_t k = 1; k + 1 < count; ++k) { // a fan about the first
        const std::uint32_t triangle = add_triangle(0, k, k + 1);
        if (k > 1) {
            link(3 * triangle, 3 * triangle - 1);
            suspects_.push_back(3 * triangle);
        }
    }
    make_delaunay();
}

void Mesher::adopt(Net &&net, std::uint32_t tracked) {
    net_ = std::move(net);
    candidates_.assign(net_.corners.size() / 3, none);
    queue_ = {};
    queue_.reach(candidates_.size());
    spokes_.assign(tracked, none);
    for (std::uint32_t edge = 0; edge < net_.corners.size(); ++edge) {
        if (net_.corners[edge] < tracked) {
            spokes_[net_.corners[edge]] = edge;
        }
    }
}

void Mesher::track_all() {
    spokes_.assign(net_.vertices.size(), none);
    for (std::uint32_t edge = 0; edge < net_.corners.size(); ++edge) {
        if (net_.corners[edge] != none) {
            spokes_[net_.corners[edge]] = edge;
        }
    }
}

Net Mesher::release() {
    return std::move(net_);
}

std::uint32_t Mesher::insert_on_rim(std::uint32_t before, Spot spot) {
    std::uint32_t edge = spokes_[before];
    while (net_.twins[edge] != none) { // turn back to the rim
        edge = next(net_.twins[edge]);
    }
    const std::uint32_t vertex = add_vertex(spot);
    spokes_.resize(net_.vertices.size(), none);
    split_edge(edge, vertex);
    settle();
    return vertex;
}

void Mesher::insert(std::uint32_t triangle, Spot spot) {
    const std::uint32_t p = add_vertex(spot);
    for (std::uint32_t edge = 3 * triangle; edge < 3 * triangle + 3; ++edge) {
        if (turn(at(net_.corners[edge]), at(net_.corners[next(edge)]), spot) == 0) {
            split_edge(edge, p);
            settle();
            scan_around(triangle);
            return;
        }
    }
    split_triangle(triangle, p);
    settle();
    scan_around(triangle);
}

// Of every new triangle p is the third corner. a b c -> (a b p) (b c p) (c a p)
void Mesher::split_triangle(std::uint32_t t0, std::uint32_t p) {
    const std::uint32_t e = 3 * t0;
    const std::uint32_t a = net_.corners[e], b = net_.corners[e + 1], c = net_.corners[e + 2];
    const std::uint32_t bc = net_.twins[e + 1], ca = net_.twins[e + 2];
    set_triangle(t0, a, b, p);
    const std::uint32_t t1 = add_triangle(b, c, p), t2 = add_triangle(c, a, p);
    link(3 * t1, bc);
    link(3 * t2, ca);
    link(e + 1, 3 * t1 + 2);
    link(3 * t1 + 1, 3 * t2 + 2);
    link(3 * t2 + 1, e + 2);
    suspects_.assign({e, 3 * t1, 3 * t2});
}

// p on the edge a -> b of (a b c), and on b -> a of (b a d) where there is one.
void Mesher::split_edge(std::uint32_t ab, std::uint32_t p) {
    const std::uint32_t t0 = ab / 3, bc = next(ab), ca = previous(ab), ba = net_.twins[ab];
    const std::uint32_t a = net_.corners[ab], b = net_.corners[bc], c = net_.corners[ca];
    const std::uint32_t outer_bc = net_.twins[bc], outer_ca = net_.twins[ca];
    set_triangle(t0, c, a, p);
    const std::uint32_t t1 = add_triangle(b, c, p);
    link(3 * t0, outer_ca);
    link(3 * t1, outer_bc);
    link(3 * t1 + 1, 3 * t0 + 2);
    net_.twins[3 * t0 + 1] = none;
    suspects_.assign({3 * t0, 3 * t1});
    if (ba == none) {
        return;
    }
    const std::uint32_t s0 = ba / 3, ad = next(ba), db = previous(ba);
    const std::uint32_t d = net_.corners[db], outer_ad = net_.twins[ad], outer_db = net_.twins[db];
    set_triangle(s0, d, b, p);
    const std::uint32_t s1 = add_triangle(a, d, p);
    link(3 * s0, outer_db);
    link(3 * s1, outer_ad);
    link(3 * s1 + 1, 3 * s0 + 2);
    link(3 * t0 + 1, 3 * s1 + 2); // a -> p, p -> a
    link(3 * s0 + 1, 3 * t1 + 2); // b -> p, p -> b
    suspects_.insert(suspects_.end(), {3 * s0, 3 * s1});
}

bool Mesher::must_flip(std::uint32_t ab) const {
    const std::uint32_t ba = net_.twins[ab];
    if (ba == none) {
        return false;
    }
    return in_circle(at(net_.corners[ab]), at(net_.corners[next(ab)]), at(net_.corners[previous(ab)]),
                     at(net_.corners[previous(ba)])) > 0;
}

// (a b p) and (b a d) -> (a d p) and (d b p)
void Mesher::flip(std::uint32_t ab) {
    const std::uint32_t ba = net_.twins[ab];
    const std::uint32_t bp = next(ab), pa = previous(ab), ad = next(ba), db = previous(ba);
    const std::uint32_t a = net_.corners[ab], b = net_.corners[bp], d = net_.corners[db],
                        p = net_.corners[pa];
    const std::uint32_t t = ab / 3, s = ba / 3;
    const std::uint32_t outer_bp = net_.twins[bp], outer_pa = net_.twins[pa];
    const std::uint32_t outer_ad = net_.twins[ad], outer_db = net_.twins[db];
    set_triangle(t, a, d, p);
    set_triangle(s, d, b, p);
    link(3 * t, outer_ad);
    link(3 * t + 2, outer_pa);
    link(3 * s, outer_db);
    link(3 * s + 1, outer_bp);
    link(3 * t + 1, 3 * s + 2);
}

void Mesher::settle() {
    while (!suspects_.empty()) {
        const std::uint32_t edge = suspects_.back();
        suspects_.pop_back();
        if (must_flip(edge)) {
            const std::uint32_t other = net_.twins[edge] / 3;
            flip(edge);
            suspects_.push_back(edge / 3 * 3);
            suspects_.push_back(3 * other);
        }
    }
}

void Mesher::scan(std::uint32_t triangle) {
    const std::uint32_t *corner = &net_.corners[3 * triangle];
    unsigned fixed = 0;
    for (std::uint32_t side = 0; rim_is_fixed_ && side < 3; ++side) {
        fixed |= net_.twins[3 * triangle + side] == none ? 1U << side : 0U;
    }
    const Worst worst = scan_triangle(view_, at(corner[0]), at(corner[1]), at(corner[2]), tolerance_, fixed);
    candidates_[triangle] = worst.pixel;
    queue_.drop(triangle);
    if (worst.pixel != none) {
        queue_.add(triangle, worst.error);
    }
}

// Scans the triangles about the third corner of `triangle`.
void Mesher::scan_around(std::uint32_t triangle) {
    std::uint32_t t = triangle;
    do {
        scan(t);
        const std::uint32_t twin = net_.twins[3 * t + 1];
        if (twin == none) {
            break;
        }
        t = twin / 3;
    } while (t != triangle);
    if (net_.twins[3 * t + 1] != none) {
        return; // all the way round
    }
    for (std::uint32_t twin = net_.twins[3 * triangle + 2]; twin != none; twin = net_.twins[3 * t + 2]) {
        t = twin / 3;
        scan(t);
    }
}

void Mesher::drain(std::size_t most) {
    for (std::uint32_t worst = queue_.worst(); worst != none && net_.vertices.size() < most;
         worst = queue_.worst()) {
        insert(worst, unpacked(candidates_[worst]));
    }
}

void Mesher::refine_all(std::size_t most) {
    for (std::uint32_t triangle = 0; triangle < candidates_.size(); ++triangle) {
        scan(triangle);
    }
    drain(most);
}

// From the suspects on; what flipped goes into changed_.
void Mesher::make_delaunay() {
    changed_.clear();
    while (!suspects_.empty()) {
        const std::uint32_t edge = suspects_.back();
        suspects_.pop_back();
        if (!must_flip(edge)) {
            continue;
        }
        const std::uint32_t t = edge / 3, s = net_.twins[edge] / 3;
        flip(edge);
        suspects_.insert(suspects_.end(), {3 * t, 3 * t + 2, 3 * s, 3 * s + 1});
        changed_.insert(changed_.end(), {t, s});
    }
}

void Mesher::mend(const std::vector<std::uint32_t> &edges) {
    suspects_.assign(edges.begin(), edges.end());
    make_delaunay();
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    for (const std::uint32_t triangle : changed_) {
        scan(triangle);
    }
    drain(none);
}

// The polygon around a vertex, and its triangles into freed_. False for a corner of the rectangle.
bool Mesher::gather_hole(std::uint32_t vertex) {
    hole_.clear();
    freed_.clear();
    const std::uint32_t start = spokes_[vertex];
    if (start == none) {
        return false;
    }
    std::uint32_t first = start;
    bool on_rim = false;
    for (;;) { // turn back to the rim, or once round
        const std::uint32_t twin = net_.twins[first];
        if (twin == none) {
            on_rim = true;
            break;
        }
        first = next(twin);
        if (first == start) {
            break;
        }
    }
    std::uint32_t edge = first;
    for (;;) {
        hole_.push_back({net_.corners[next(edge)], net_.twins[next(edge)]});
        freed_.push_back(edge / 3);
        const std::uint32_t twin = net_.twins[previous(edge)];
        if (twin == none) {
            hole_.push_back({net_.corners[previous(edge)], none});
            break;
        }
        edge = twin;
        if (edge == first) {
            break;
        }
    }
    return hole_.size() >= 3 && hole_.size() <= 48 &&
           (!on_rim || turn(at(hole_.front().vertex), at(vertex), at(hole_.back().vertex)) == 0);
}

bool Mesher::remove(std::uint32_t vertex) {
    if (!gather_hole(vertex)) {
        return false;
    }
    if (!fill_hole()) {
        return false;
    }
    spokes_[vertex] = none;
    return true;
}

// Cuts Delaunay ears off the hole. Changes the net only when all new triangles keep the tolerance.
bool Mesher::fill_hole() {
    made_.clear(); // three corners and three links each; a link of 2^31 + e is edge e of the new triangles
    constexpr std::uint32_t inner = 1U << 31;
    std::vector<Tip> &hole = hole_;
    while (hole.size() >= 3) {
        const std::size_t count = hole.size();
        std::size_t ear = count;
        for (std::size_t k = 0; k < count && ear == count; ++k) {
            const std::size_t before = (k + count - 1) % count, after = (k + 1) % count;
            const Spot a = at(hole[before].vertex), b = at(hole[k].vertex), c = at(hole[after].vertex);
            if (turn(a, b, c) <= 0) {
                continue;
            }
            bool empty = true;
            for (std::size_t other = 0; other < count && empty; ++other) {
                empty = other == before || other == k || other == after ||
                        in_circle(a, b, c, at(hole[other].vertex)) <= 0;
            }
            if (empty) {
                ear = k;
            }
        }
        if (ear == count) {
            return false;
        }
        const std::size_t before = (ear + count - 1) % count, after = (ear + 1) % count;
        const Tip a = hole[before], b = hole[ear], c = hole[after];
        if (scan_triangle(view_, at(a.vertex), at(b.vertex), at(c.vertex), tolerance_).pixel != none) {
            return false;
        }
        const auto made = static_cast<std::uint32_t>(made_.size() / 6);
        made_.insert(made_.end(), {a.vertex, b.vertex, c.vertex, a.outside, b.outside, c.outside});
        if (count == 3) {
            break;
        }
        made_[made_.size() - 1] = none; // c -> a is linked when its other side is made
        hole[before].outside = inner + 3 * made + 2;
        hole.erase(hole.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    const auto count = static_cast<std::uint32_t>(made_.size() / 6);
    for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t *made = &made_[6 * k];
        set_triangle(freed_[k], made[0], made[1], made[2]);
        candidates_[freed_[k]] = none;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
        for (std::uint32_t side = 0; side < 3; ++side) {
            const std::uint32_t outside = made_[6 * k + 3 + side], edge = 3 * freed_[k] + side;
            if (outside == none) {
                if (side < 2 || k + 1 == count) {
                    net_.twins[edge] = none;
                }
            } else if (outside >= inner) {
                link(edge, 3 * freed_[(outside - inner) / 3] + (outside - inner) % 3);
            } else {
                link(edge, outside);
            }
        }
    }
    for (std::size_t k = count; k < freed_.size(); ++k) {
        net_.corners[3 * freed_[k]] = none;
        candidates_[freed_[k]] = none;
    }
    return true;
}

} // namespace paradize::terrain
