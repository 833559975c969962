#include "terrain/mesher.hpp"

#include <algorithm>
#include <utility>

namespace paradize::terrain {

std::uint32_t Mesher::add_vertex(Pixel spot) {
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

void Mesher::start(const std::vector<Pixel> &corners) {
    constexpr std::size_t some = 4096; // triangles: room for a tile of common ground
    net_ = {};
    net_.vertices.reserve(some / 2);
    net_.corners.reserve(3 * some);
    net_.twins.reserve(3 * some);
    candidates_.reserve(some);
    queue_.reserve(some);
    candidates_.clear();
    spokes_.assign(corners.size(), none);
    for (const Pixel corner : corners) {
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

void Mesher::adopt(HalfEdgeMesh &&net, std::uint32_t tracked) {
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

HalfEdgeMesh Mesher::release() {
    return std::move(net_);
}

std::uint32_t Mesher::insert_on_rim(std::uint32_t before, Pixel spot) {
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

void Mesher::insert(std::uint32_t triangle, Pixel spot) {
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

} // namespace paradize::terrain
