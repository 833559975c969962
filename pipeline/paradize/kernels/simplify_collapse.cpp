#include "simplify_collapse.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "simplify_cost.hpp"
#include "simplify_mesh.hpp"
#include "simplify_quadric.hpp"
#include "simplify_queue.hpp"

namespace paradize::simplify {

namespace {

constexpr double damping = 1e-6;     // of the trace: directions that count for less are left as they are
constexpr double far_off = 2.0;      // edge lengths that a vertex may be placed off the edge's middle
constexpr double least_turn = 0.25;  // cosine of the angle by which a triangle may turn
constexpr double least_shape = 1e-4; // twice the area of a triangle, of its longest edge squared
constexpr double short_first = 1e-9; // of an edge's length to the fourth: short ones first on flat ground

using Numbers = std::vector<std::uint32_t>;

struct Choice {
    double cost;
    Vec at;
};

inline void fetch(const void *address) {
    __builtin_prefetch(address);
}

class Simplifier {
  public:
    Simplifier(const Input &in, const Limits &lim)
        : input(in), limits(lim), surface(join(in.triangles, in.place, in.group, in.locked)),
          memory(remember(in, surface)), state(surface.edges(), queued), seen(surface.vertices(), 0),
          alive(surface.triangles(), 1), moved(surface.wedges(), 0), left(surface.triangles()) {}

    Result run() {
        measure_parts();
        for (std::uint32_t e = 0; e < surface.edges(); ++e) {
            queue.push(e, Queue::bucket(evaluate(surface.half[e], Part::shape).cost));
        }
        Result result;
        result.stop = Stop::target;
        std::size_t before = left + 1;
        while (left > limits.target) {
            std::uint32_t bucket = 0;
            const std::uint32_t e = queue.pop(bucket);
            if (e == none) {
                if (left == before) {
                    result.stop = stopped_by_error ? Stop::error : Stop::nothing;
                    break;
                }
                before = left;
                wake_all();
                continue;
            }
            fetch_ahead();
            if (state[e] != dead) {
                try_edge(e, bucket);
            }
        }
        result.error = worst;
        write(result);
        return result;
    }

  private:
    enum State : std::uint8_t { queued, parked, dead };

    const Input &input;
    const Limits &limits;
    Surface surface;
    Memory memory;
    Queue queue;
    std::vector<std::uint8_t> state; // of each edge
    Numbers seen;                    // of each vertex: the last mark it got
    std::uint32_t mark = 0;
    std::vector<std::uint8_t> alive; // of each triangle
    std::vector<std::uint8_t> moved; // of each wedge
    std::size_t left;
    double worst = 0.0;
    bool stopped_by_error = false;
    std::vector<double> part_area;
    std::vector<double> part_least;
    // Of the edge in hand: half-edges round both ends, and which wedges become one.
    Numbers ring_p;
    Numbers ring_q;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    Numbers wedges;

    double twice_area(std::uint32_t t) const {
        const std::uint32_t *v = &surface.vertex[3 * t];
        const Vec a = memory.corners[v[0]].at;
        return length(cross(memory.corners[v[1]].at - a, memory.corners[v[2]].at - a));
    }

    // Of the edges that come next, what they will be tried with: memory is far.
    void fetch_ahead() const {
        const std::uint32_t third = queue.ahead(24);
        fetch(&state[third]);
        fetch(&surface.half[third]);
        const std::uint32_t second = surface.half[queue.ahead(16)];
        fetch(&surface.vertex[second]);
        fetch(&surface.twin[second]);
        fetch(&surface.wedge[second]);
        const std::uint32_t first = surface.half[queue.ahead(8)];
        for (const std::uint32_t i : {first, next(first)}) {
            const Corner &corner = memory.corners[surface.vertex[i]];
            fetch(&corner);
            fetch(&corner.area);
            if (!memory.drift.empty()) {
                const std::uint32_t w = surface.wedge[i];
                fetch(&memory.area[w]);
                fetch(&memory.drift[w]);
                fetch(&memory.drift[w].c);
                const Slope *slopes = memory.slopes.data() + w * memory.width;
                for (std::size_t k = 0; k < memory.width; k += 2) {
                    fetch(slopes + k);
                }
            }
        }
    }

    void measure_parts() {
        if (limits.kept_area <= 0) {
            return;
        }
        part_area.assign(surface.parts, 0.0);
        for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
            part_area[surface.part[surface.vertex[3 * t]]] += twice_area(t);
        }
        for (const double area : part_area) {
            part_least.push_back(limits.kept_area * area);
        }
    }

    void wake_all() {
        for (std::uint32_t e = 0; e < surface.edges(); ++e) {
            if (state[e] == parked) {
                state[e] = queued;
                queue.push(e, Queue::bucket(evaluate(surface.half[e], Part::shape).cost));
            }
        }
    }

    // Wedges of both ends of half-edge h as sets that become one: those of the edge's triangles pair up.
    void match_wedges(std::uint32_t h) {
        pairs.clear();
        wedges.clear();
        const std::uint32_t t = surface.twin[h];
        pairs.emplace_back(surface.wedge[h], surface.wedge[next(h)]);
        if (t != none && (surface.wedge[next(t)] != pairs[0].first || surface.wedge[t] != pairs[0].second)) {
            pairs.emplace_back(surface.wedge[next(t)], surface.wedge[t]);
        }
        if (surface.split[surface.vertex[h]] == 0 && surface.split[surface.vertex[next(h)]] == 0) {
            return;
        }
        const auto lone = [&](std::uint32_t i) {
            const std::uint32_t w = surface.wedge[i];
            for (const auto &[a, b] : pairs) {
                if (a == w || b == w) {
                    return;
                }
            }
            if (std::find(wedges.begin(), wedges.end(), w) == wedges.end()) {
                wedges.push_back(w);
            }
        };
        around(surface, h, lone);
        around(surface, next(h), lone);
    }

    // Calls use(a, b, c) for every set: wedges of one set, or none.
    template <typename Use>
    void for_sets(Use &&use) const {
        const auto &first = pairs[0];
        if (pairs.size() == 1) {
            use(first.first, first.second, none);
        } else if (first.first == pairs[1].first) {
            use(first.first, first.second, pairs[1].second);
        } else if (first.second == pairs[1].second) {
            use(first.first, first.second, pairs[1].first);
        } else {
            use(first.first, first.second, none);
            use(pairs[1].first, pairs[1].second, none);
        }
        for (const std::uint32_t w : wedges) {
            use(w, none, none);
        }
    }

    void add_drift(Quadric &sum, std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        double area = memory.area[a];
        sum += memory.drift[a];
        for (const std::uint32_t w : {b, c}) {
            if (w != none) {
                area += memory.area[w];
                sum += memory.drift[w];
            }
        }
        if (!(area > 0)) {
            return;
        }
        for (std::size_t k = 0; k < memory.width; ++k) {
            if (memory.squares[k] == 0.0) {
                continue;
            }
            Slope slope = memory.slopes[a * memory.width + k];
            for (const std::uint32_t w : {b, c}) {
                if (w != none) {
                    slope += memory.slopes[w * memory.width + k];
                }
            }
            sum.add({slope.x, slope.y, slope.z}, slope.d, -memory.squares[k] / area);
        }
    }

    // The cost of the shape alone is a bound of the whole cost from below, and cheap.
    enum class Part : std::uint8_t { shape, whole };

    Choice evaluate(std::uint32_t h, Part what) {
        const std::uint32_t vp = surface.vertex[h];
        const std::uint32_t vq = surface.vertex[next(h)];
        const Corner &p = memory.corners[vp];
        const Corner &q = memory.corners[vq];
        Quadric all = p.shape;
        all += q.shape;
        if (what == Part::whole) {
            match_wedges(h);
            for_sets([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { add_drift(all, a, b, c); });
        }
        const Vec middle = 0.5 * (p.at + q.at);
        const Vec along = q.at - p.at;
        const double square = dot(along, along);
        Choice choice{};
        if (surface.locked[vp] != 0 || surface.locked[vq] != 0) {
            choice.at = surface.locked[vp] != 0 ? p.at : q.at;
            choice.cost = all.value(choice.at);
        } else {
            choice.at = middle;
            const bool found = least(all, damping, choice.at);
            const Vec off = choice.at - middle;
            if (found && dot(off, off) <= far_off * far_off * square) {
                choice.cost = all.value(choice.at);
            } else {
                const double at_p = all.value(p.at);
                const double at_q = all.value(q.at);
                choice.at = at_p <= at_q ? p.at : q.at;
                choice.cost = std::min(at_p, at_q);
            }
        }
        choice.cost = std::max(choice.cost, 0.0) + short_first * square * square;
        return choice;
    }

    // How far the surface round half-edge h comes to lie off, root of the mean square.
    double error_at(std::uint32_t h, Vec at) const {
        const Corner &p = memory.corners[surface.vertex[h]];
        const Corner &q = memory.corners[surface.vertex[next(h)]];
        Quadric shape = p.shape;
        shape += q.shape;
        const double area = p.area + q.area;
        return area > 0 ? std::sqrt(std::max(shape.value(at), 0.0) / area) : 0.0;
    }

    void collect(std::uint32_t h, Numbers &ring) const {
        ring.clear();
        around(surface, h, [&](std::uint32_t i) { ring.push_back(i); });
    }

    // Whether the surface stays one of the same kind: the ends have no neighbours in common but the tips of
    // the edge's triangles, and no triangle loses both its neighbours there.
    bool links(std::uint32_t h) {
        const std::uint32_t t = surface.twin[h];
        const std::uint32_t vp = surface.vertex[h];
        const std::uint32_t vq = surface.vertex[next(h)];
        if (surface.locked[vp] != 0 && surface.locked[vq] != 0) {
            return false;
        }
        if (t != none && surface.border[vp] != 0 && surface.border[vq] != 0) {
            return false;
        }
        for (const std::uint32_t side : {h, t}) {
            if (side == none) {
                continue;
            }
            const std::uint32_t a = surface.twin[next(side)];
            const std::uint32_t b = surface.twin[previous(side)];
            if ((a == none && b == none) || (a != none && b != none && a / 3 == b / 3)) {
                return false;
            }
        }
        if (mark > none - 4) {
            std::fill(seen.begin(), seen.end(), 0);
            mark = 0;
        }
        mark += 2;
        for (const std::uint32_t i : ring_p) {
            seen[surface.vertex[next(i)]] = mark;
            seen[surface.vertex[previous(i)]] = mark;
        }
        seen[vp] = seen[vq] = 0;
        std::uint32_t common = 0;
        for (const std::uint32_t i : ring_q) {
            for (const std::uint32_t j : {next(i), previous(i)}) {
                std::uint32_t &s = seen[surface.vertex[j]];
                common += s == mark;
                s += s == mark;
            }
        }
        return common == (t == none ? 1u : 2u);
    }

    // Whether no triangle turns over or becomes a line with the edge's ends at `at`.
    bool keeps_shape(std::uint32_t h, Vec at) const {
        const std::uint32_t t = surface.twin[h];
        for (const Numbers *ring : {&ring_p, &ring_q}) {
            const Vec old = memory.corners[surface.vertex[ring == &ring_p ? h : next(h)]].at;
            for (const std::uint32_t i : *ring) {
                if (i / 3 == h / 3 || (t != none && i / 3 == t / 3)) {
                    continue;
                }
                const Vec b = memory.corners[surface.vertex[next(i)]].at;
                const Vec c = memory.corners[surface.vertex[previous(i)]].at;
                const Vec ab = b - at;
                const Vec ac = c - at;
                const Vec bc = c - b;
                const Vec before = cross(b - old, bc);
                const Vec after = cross(ab, bc);
                const double was = dot(before, before);
                const double is = dot(after, after);
                const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
                if (!(is > least_shape * least_shape * longest * longest) && !(is > was)) {
                    return false;
                }
                const double turn = dot(before, after);
                if (!(is > 0) || turn < 0 || turn * turn < least_turn * least_turn * was * is) {
                    return false;
                }
            }
        }
        return true;
    }

    // Whether the component keeps its share of area, and with `at` goes on having it.
    bool keeps_area(std::uint32_t h, Vec at) {
        if (limits.kept_area <= 0) {
            return true;
        }
        const std::uint32_t t = surface.twin[h];
        double change = 0.0;
        for (const Numbers *ring : {&ring_p, &ring_q}) {
            for (const std::uint32_t i : *ring) {
                const bool gone = i / 3 == h / 3 || (t != none && i / 3 == t / 3);
                const Vec b = memory.corners[surface.vertex[next(i)]].at;
                const Vec bc = memory.corners[surface.vertex[previous(i)]].at - b;
                const double was = length(cross(b - memory.corners[surface.vertex[i]].at, bc));
                if (!gone) {
                    change += length(cross(b - at, bc)) - was;
                } else if (ring == &ring_p) {
                    change -= was;
                }
            }
        }
        double &area = part_area[surface.part[surface.vertex[h]]];
        if (change < 0.0 && area + change < part_least[surface.part[surface.vertex[h]]]) {
            return false;
        }
        area += change;
        return true;
    }

    // Whether a locked vertex would lose a wedge of its own.
    bool melts_locked(std::uint32_t h) {
        const bool fixed_p = surface.locked[surface.vertex[h]] != 0;
        const bool fixed_q = surface.locked[surface.vertex[next(h)]] != 0;
        if (!fixed_p && !fixed_q) {
            return false;
        }
        match_wedges(h);
        return pairs.size() == 2 &&
               (fixed_p ? pairs[0].second == pairs[1].second : pairs[0].first == pairs[1].first);
    }

    void park(std::uint32_t e) { state[e] = parked; }

    void try_edge(std::uint32_t e, std::uint32_t bucket) {
        const std::uint32_t h = surface.half[e];
        Choice choice = evaluate(h, Part::shape);
        std::uint32_t now = Queue::bucket(choice.cost);
        if (now <= bucket && !memory.drift.empty()) {
            choice = evaluate(h, Part::whole);
            now = Queue::bucket(choice.cost);
        }
        if (now > bucket) {
            queue.push(e, now);
            return;
        }
        const double error = error_at(h, choice.at);
        if (error > limits.max_error) {
            stopped_by_error = true;
            park(e);
            return;
        }
        collect(h, ring_p);
        // The other ring starts at a half-edge that leaves q.
        collect(next(h), ring_q);
        if (!links(h) || melts_locked(h) || !keeps_shape(h, choice.at) || !keeps_area(h, choice.at)) {
            park(e);
            return;
        }
        worst = std::max(worst, error);
        collapse(h, choice.at, bucket);
    }

    void merge_wedges(std::uint32_t keep, std::uint32_t other) {
        memory.area[keep] += memory.area[other];
        if (!memory.drift.empty()) {
            memory.drift[keep] += memory.drift[other];
        }
        for (std::size_t k = 0; k < memory.width; ++k) {
            memory.slopes[keep * memory.width + k] += memory.slopes[other * memory.width + k];
        }
    }

    void rename(std::uint32_t from, std::uint32_t to) {
        for (const Numbers *ring : {&ring_p, &ring_q}) {
            for (const std::uint32_t i : *ring) {
                if (surface.wedge[i] == from) {
                    surface.wedge[i] = to;
                }
            }
        }
    }

    void close(std::uint32_t side) {
        const std::uint32_t n = next(side);
        const std::uint32_t p = previous(side);
        const std::uint32_t a = surface.twin[n];
        const std::uint32_t b = surface.twin[p];
        // The edge that waits in the queue stays: its place there is no higher than its cost.
        std::uint32_t keep = surface.edge[p];
        std::uint32_t drop = surface.edge[n];
        if (state[keep] != queued && state[drop] == queued) {
            std::swap(keep, drop);
        }
        state[drop] = dead;
        for (const auto &[i, j] : {std::pair{a, b}, std::pair{b, a}}) {
            if (i != none) {
                surface.twin[i] = j;
                surface.edge[i] = keep;
                surface.half[keep] = i;
            }
        }
        alive[side / 3] = 0;
        --left;
    }

    void collapse(std::uint32_t h, Vec at, std::uint32_t bucket) {
        const std::uint32_t t = surface.twin[h];
        const std::uint32_t vp = surface.vertex[h];
        const std::uint32_t vq = surface.vertex[next(h)];
        const bool several = surface.split[vp] != 0 || surface.split[vq] != 0;
        match_wedges(h);
        const bool fixed_p = surface.locked[vp] != 0;
        const bool fixed_q = surface.locked[vq] != 0;
        for_sets([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            if (b == none) {
                return;
            }
            // What is locked keeps its attributes: its wedge stays.
            const std::uint32_t keep = fixed_q ? b : a;
            for (const std::uint32_t w : {a, b, c}) {
                if (w != none && w != keep) {
                    merge_wedges(keep, w);
                    rename(w, keep);
                }
            }
            moved[keep] |= !fixed_p && !fixed_q;
        });
        const Corner &q = memory.corners[vq];
        Corner &p = memory.corners[vp];
        p.shape += q.shape;
        p.area += q.area;
        const bool stays = fixed_p || fixed_q;
        if (fixed_q) {
            surface.home[vp] = surface.home[vq];
        }
        p.at = at;
        surface.locked[vp] |= surface.locked[vq];
        surface.border[vp] |= surface.border[vq];
        for (const std::uint32_t i : ring_q) {
            surface.vertex[i] = vp;
        }
        // A half-edge that leaves p and lives on; the triangles' tips need none, edges hold theirs.
        std::uint32_t start = none;
        for (const std::uint32_t side : {h, t}) {
            if (side == none) {
                continue;
            }
            const std::uint32_t a = surface.twin[next(side)];
            const std::uint32_t b = surface.twin[previous(side)];
            // For h, b runs from p to the tip; for its twin, a does not: b runs from q to the tip.
            start = b != none ? b : next(a);
        }
        close(h);
        if (t != none) {
            close(t);
        }
        state[surface.edge[h]] = dead;
        refresh(start, vp, several, stays, bucket);
    }

    // After a collapse: edges round the vertex that had been put aside are tried again.
    void refresh(std::uint32_t start, std::uint32_t v, bool several, bool stays, std::uint32_t bucket) {
        std::uint8_t split = 0;
        around(surface, start, [&](std::uint32_t i) {
            split |= surface.wedge[i] != surface.wedge[start];
            if (!stays) {
                moved[surface.wedge[i]] = 1;
            }
            for (const std::uint32_t e : {surface.edge[i], surface.edge[previous(i)]}) {
                if (state[e] == parked) {
                    state[e] = queued;
                    queue.push(e, bucket);
                }
            }
        });
        surface.split[v] = several ? split : 0;
    }

    void write(Result &result) const {
        const std::size_t width = memory.width;
        Numbers number(surface.wedges(), none);
        Numbers place(input.place.size(), none);
        std::uint32_t places = 0;
        for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
            if (alive[t] == 0) {
                continue;
            }
            result.triangle.push_back(surface.triangle[t]);
            for (std::uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
                const std::uint32_t w = surface.wedge[h];
                if (number[w] == none) {
                    number[w] = static_cast<std::uint32_t>(result.vertex.size());
                    result.vertex.push_back(surface.source[w]);
                    const Vec at = memory.corners[surface.vertex[h]].at;
                    result.positions.insert(result.positions.end(), {at.x, at.y, at.z});
                    std::uint32_t &known = place[surface.home[surface.vertex[h]]];
                    known = known == none ? places++ : known;
                    result.place.push_back(known);
                    write_attributes(result, w, at, width);
                }
                result.triangles.push_back(number[w]);
            }
        }
    }

    void write_attributes(Result &result, std::uint32_t w, Vec at, std::size_t width) const {
        const double area = memory.area[w];
        const std::size_t first = result.attributes.size();
        for (std::size_t k = 0; k < width; ++k) {
            const float source = input.attributes[surface.source[w] * width + k];
            const bool kept = moved[w] == 0 || !(area > 0);
            result.attributes.push_back(
                kept ? source : static_cast<float>(memory.slopes[w * width + k].value(at) / area));
        }
        if (moved[w] != 0 && input.unit >= 0) {
            float *n = result.attributes.data() + first + static_cast<std::size_t>(input.unit);
            const Vec direction = unit(Vec{n[0], n[1], n[2]});
            if (direction == Vec{}) {
                for (std::size_t k = 0; k < 3; ++k) {
                    n[k] =
                        input
                            .attributes[surface.source[w] * width + static_cast<std::size_t>(input.unit) + k];
                }
                return;
            }
            n[0] = static_cast<float>(direction.x);
            n[1] = static_cast<float>(direction.y);
            n[2] = static_cast<float>(direction.z);
        }
    }
};

} // namespace

Result simplify(const Input &input, const Limits &limits) {
    return Simplifier(input, limits).run();
}

} // namespace paradize::simplify
