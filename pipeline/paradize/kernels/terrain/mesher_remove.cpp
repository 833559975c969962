#include "terrain/mesher.hpp"

namespace paradize::terrain {

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
    std::vector<HoleCorner> &hole = hole_;
    while (hole.size() >= 3) {
        const std::size_t count = hole.size();
        std::size_t ear = count;
        for (std::size_t k = 0; k < count && ear == count; ++k) {
            const std::size_t before = (k + count - 1) % count, after = (k + 1) % count;
            const Pixel a = at(hole[before].vertex), b = at(hole[k].vertex), c = at(hole[after].vertex);
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
        const HoleCorner a = hole[before], b = hole[ear], c = hole[after];
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
