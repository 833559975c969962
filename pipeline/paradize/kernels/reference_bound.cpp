#include "reference_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reference_distance.hpp"
#include "reference_samples.hpp"

namespace paradize::reference {
namespace {

// Pieces that are cut together, and triangles that are looked at together; fixed, so that results do not
// depend on threads.
constexpr std::size_t batch_size = 1024, batch_chunk = 32, chunk_size = 256;
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double flat = 1e-10; // squared width of a needle, of its length's square: signs are unsure there

double squared(const Point &a, const Point &b) {
    const Point d = minus(a, b);
    return dot(d, d);
}

double to_side(const Point &p, const Point &a, const Point &side) {
    const Point off = minus(p, a);
    const double along_it = dot(off, side), length = dot(side, side);
    if (!(along_it > 0))
        return dot(off, off);
    return squared(off, along({}, along_it < length ? along_it / length : 1.0, side));
}

// Squared distance to a point of the triangle, the nearest but for rounding: never too small. The nearest
// lies inside or on a side that the place is outside of.
double squared(const Point &p, const Corners &t) {
    const Point u = minus(t[1], t[0]), v = minus(t[2], t[0]), w = minus(p, t[0]);
    const Point n = cross(u, v);
    const double nn = dot(n, n);
    const double one = dot(cross(w, v), n), two = dot(cross(u, w), n), zero = nn - one - two;
    const double long_side = std::max(dot(u, u), dot(v, v));
    const bool needle = nn <= flat * long_side * long_side;
    double best = std::numeric_limits<double>::max();
    if (one > 0 && two > 0 && zero > 0) {
        best = squared(w, along(along({}, one / nn, u), two / nn, v));
        if (!needle)
            return best;
    }
    if (needle || !(one > 0))
        best = std::min(best, to_side(p, t[0], v));
    if (needle || !(two > 0))
        best = std::min(best, to_side(p, t[0], u));
    if (needle || !(zero > 0))
        best = std::min(best, to_side(p, t[1], minus(t[2], t[1])));
    return best;
}

// A triangle of the other surface, by its slot in the tree, and how far a place is from it.
struct Near {
    double distance = infinite;
    std::uint32_t slot = 0;
    bool nearest = false; // no triangle is nearer
};

// A part of a triangle of `from`.
struct Piece {
    Corners at;
    std::array<Near, 3> near; // of its corners
    Near middle;              // looked up where the triangles of the corners do not bound it well enough
    std::uint32_t best = 0;   // the triangle of `to` that gave `most`
    double most = infinite;   // no point of it lies farther
    unsigned cuts = 0;        // that made it
};

// One thread's work on one direction.
class Cutter {
  public:
    Cutter(const Tree &from, const Tree &to, double enough, double fine)
        : from_(from), to_(to), enough_(enough), fine_(fine) {}

    std::uint64_t tests() const { return tests_; }
    // The largest distance of a corner, or what is not below `before`: by convexity, that of any point
    // between is no larger.
    double farthest(const Corners &at, std::uint32_t slot, double before) {
        const Corners other = to_.corners(slot);
        double most = 0;
        for (std::size_t k = 0; k < 3 && most < before; ++k)
            most = std::max(most, std::sqrt(measured(at[k], other)));
        return most;
    }
    Piece whole(std::size_t triangle, std::uint32_t near) {
        Piece piece;
        piece.at = corners_of(from_.surface(), triangle);
        piece.near.fill({infinite, near, false});
        piece.middle = {infinite, near, false};
        piece.best = near;
        for (std::size_t k = 0; k < 3; ++k)
            piece.near[k] = nearest(piece.at[k], piece);
        bound(piece);
        return piece;
    }
    std::array<Piece, 2> cut(const Piece &piece);

  private:
    double measured(const Point &p, const Corners &t) {
        ++tests_;
        return squared(p, t);
    }
    double distance(const Point &p, std::uint32_t slot) { return std::sqrt(measured(p, to_.corners(slot))); }
    Near known(const Point &p, const Piece &piece);
    Near nearest(const Point &p, const Piece &piece);
    void bound(Piece &piece);
    double crossing(const Point &a, const Point &b, std::uint32_t inner, std::uint32_t outer, double low,
                    double high);

    const Tree &from_;
    const Tree &to_;
    double enough_; // bounds up to this are not lowered
    double fine_;   // how near to the place where two triangles are equally far a piece is cut
    std::uint64_t tests_ = 0;
};

std::array<std::uint32_t, 5> slots_of(const Piece &piece) {
    return {piece.best, piece.middle.slot, piece.near[0].slot, piece.near[1].slot, piece.near[2].slot};
}

// The nearest of those that the piece knows.
Near Cutter::known(const Point &p, const Piece &piece) {
    const auto slots = slots_of(piece);
    Near found;
    for (std::size_t k = 0; k < slots.size(); ++k) {
        if (std::find(slots.begin(), slots.begin() + k, slots[k]) != slots.begin() + k)
            continue;
        if (const double d = measured(p, to_.corners(slots[k])); d < found.distance)
            found = {d, slots[k], false};
    }
    found.distance = std::sqrt(found.distance);
    return found;
}

Near Cutter::nearest(const Point &p, const Piece &piece) {
    Near found = known(p, piece);
    double best = found.distance * found.distance;
    to_.search_slots(p, best, [&](std::size_t slot) {
        const Corners t = to_.corners(slot);
        double off = 0; // of the triangle's box
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double low = std::min({t[0][axis], t[1][axis], t[2][axis]}) - p[axis],
                         high = p[axis] - std::max({t[0][axis], t[1][axis], t[2][axis]});
            const double out = std::max({low, high, 0.0});
            off += out * out;
        }
        if (off >= best) {
            ++tests_;
            return;
        }
        if (const double d = measured(p, t); d < best) {
            best = d;
            found.slot = static_cast<std::uint32_t>(slot);
        }
    });
    found.distance = std::sqrt(best);
    found.nearest = true;
    return found;
}

// Lowers `most` as far as it is worth.
void Cutter::bound(Piece &piece) {
    const Corners &c = piece.at;
    const auto &near = piece.near;
    // Every point of a triangle lies within its longest side over the root of three of a corner.
    const double longest =
        std::sqrt(std::max({squared(c[0], c[1]), squared(c[1], c[2]), squared(c[2], c[0])}));
    const double corner = std::max({near[0].distance, near[1].distance, near[2].distance});
    piece.most = std::min(piece.most, corner + longest / std::sqrt(3.0));
    const auto by = [&](std::uint32_t slot) {
        if (piece.most <= enough_)
            return;
        if (const double found = farthest(c, slot, piece.most); found < piece.most) {
            piece.most = found;
            piece.best = slot;
        }
    };
    const auto slots = slots_of(piece);
    for (std::size_t k = 0; k < slots.size(); ++k)
        if (std::find(slots.begin(), slots.begin() + k, slots[k]) == slots.begin() + k)
            by(slots[k]);
    if (piece.most <= enough_)
        return;
    const Point middle = along(along(c[0], 1.0 / 3, minus(c[1], c[0])), 1.0 / 3, minus(c[2], c[0]));
    piece.middle = nearest(middle, piece);
    by(piece.middle.slot);
}

// The share of the way from a to b where two triangles are equally far; low, high: by how much `outer` is
// nearer than `inner` at a (> 0) and at b (< 0). The Illinois variant of false position.
double Cutter::crossing(const Point &a, const Point &b, std::uint32_t inner, std::uint32_t outer, double low,
                        double high) {
    double from = 0, to = 1, share = 0.5;
    for (int step = 0, side = 0; step < 20; ++step) {
        share = (from * high - to * low) / (high - low);
        const Point p = along(a, share, minus(b, a));
        const double here = distance(p, inner) - distance(p, outer);
        if (std::abs(here) <= fine_)
            break;
        if (here > 0) {
            from = share;
            low = here;
            high = side == 1 ? high / 2 : high;
            side = 1;
        } else {
            to = share;
            high = here;
            low = side == -1 ? low / 2 : low;
            side = -1;
        }
    }
    return std::clamp(share, 0.05, 0.95); // a piece that hardly shrinks would be cut for ever
}

// Where two triangles meet or part, neither alone bounds a piece well: it is cut where both are equally far,
// along the side from the corner that the middle's triangle serves worst. Else, and every fourth time, so
// that pieces become small, the longest side is halved.
std::array<Piece, 2> Cutter::cut(const Piece &piece) {
    const Corners &c = piece.at;
    const std::uint32_t inner = piece.middle.slot;
    std::array<double, 3> off;
    for (std::size_t k = 0; k < 3; ++k)
        off[k] = distance(c[k], inner);
    const auto worst = static_cast<std::size_t>(std::ranges::max_element(off) - off.begin());
    const std::uint32_t outer = piece.near[worst].slot;
    std::size_t a = 0, b = 0;
    double share = 0.5, longest = -1;
    const bool halve = piece.cuts % 4 == 3;
    for (const std::size_t k : {(worst + 1) % 3, (worst + 2) % 3}) {
        const double low = off[worst] - piece.near[worst].distance, high = off[k] - distance(c[k], outer);
        const double length = squared(c[worst], c[k]);
        if (halve || !(low > fine_ && high < -fine_) || length < longest)
            continue;
        a = worst;
        b = k;
        share = crossing(c[a], c[b], inner, outer, low, high);
        longest = length;
    }
    if (longest < 0)
        for (std::size_t k = 0; k < 3; ++k)
            if (const double length = squared(c[k], c[(k + 1) % 3]); length > longest) {
                longest = length;
                a = k;
                b = (k + 1) % 3;
            }
    const Point middle = along(c[a], share, minus(c[b], c[a]));
    Near near = known(middle, piece);
    if (near.distance > enough_)
        near = nearest(middle, piece);
    std::array<Piece, 2> halves{piece, piece};
    halves[0].at[b] = halves[1].at[a] = middle;
    halves[0].near[b] = halves[1].near[a] = near;
    for (Piece &half : halves) {
        ++half.cuts;
        bound(half);
    }
    return halves;
}

// A distance that a point of the piece has.
double reached(const Piece &piece) {
    double most = piece.middle.nearest ? piece.middle.distance : 0;
    for (const Near &near : piece.near)
        most = std::max(most, near.nearest ? near.distance : 0);
    return most;
}

double diagonal(const Surface &surface) {
    Point low{infinite, infinite, infinite}, high{-infinite, -infinite, -infinite};
    for (const std::uint32_t vertex : surface.triangles)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double value = surface.positions[vertex * std::size_t{3} + axis];
            low[axis] = std::min(low[axis], value);
            high[axis] = std::max(high[axis], value);
        }
    return std::sqrt(squared(low, high));
}

} // namespace

Bounds farthest(const Tree &from, const Tree &to, std::span<const std::uint32_t> near, double least,
                const Closeness &closeness, unsigned threads) {
    double settled = 0; // the largest bound of what is not looked at any more
    std::uint64_t tests = 0;
    const auto enough = [&] { return least + std::max(closeness.gap * least, closeness.resolution); };
    const auto cutter = [&] { return Cutter(from, to, enough(), 0.01 * (enough() - least)); };

    const std::size_t count = near.size(), chunks = (count + chunk_size - 1) / chunk_size;
    std::vector<double> quick(chunks, 0);
    std::vector<std::uint64_t> work(chunks);
    std::vector<std::vector<Piece>> wide(chunks);
    for_chunks(chunks, threads, [&](std::size_t chunk) {
        Cutter mine = cutter();
        for (std::size_t slot = chunk * chunk_size; slot < std::min(count, (chunk + 1) * chunk_size);
             ++slot) {
            const std::uint32_t i = from.order()[slot];
            const double most = mine.farthest(corners_of(from.surface(), i), near[i], infinite);
            if (most <= enough())
                quick[chunk] = std::max(quick[chunk], most);
            else
                wide[chunk].push_back(mine.whole(i, near[i]));
        }
        work[chunk] = mine.tests();
    });
    std::vector<Piece> pieces;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
        settled = std::max(settled, quick[chunk]);
        tests += work[chunk];
        for (const Piece &piece : wide[chunk])
            least = std::max(least, reached(piece));
        pieces.insert(pieces.end(), wide[chunk].begin(), wide[chunk].end());
        wide[chunk] = {};
    }

    // Pieces by how far they may lie, the farthest first; those of one bound in the order they were made.
    std::vector<std::pair<double, std::size_t>> open;
    std::vector<std::size_t> unused;
    const auto before = [](const auto &a, const auto &b) {
        return a.first != b.first ? a.first < b.first : a.second > b.second;
    };
    const auto keep = [&](std::size_t number) {
        if (pieces[number].most <= enough()) {
            settled = std::max(settled, pieces[number].most);
            unused.push_back(number);
            return;
        }
        open.emplace_back(pieces[number].most, number);
        std::ranges::push_heap(open, before);
    };
    for (std::size_t i = 0; i < pieces.size(); ++i)
        keep(i);
    std::vector<std::size_t> batch;
    std::vector<std::array<Piece, 2>> made;
    while (!open.empty() && open.front().first > enough() && tests < closeness.tests) {
        batch.clear();
        while (!open.empty() && open.front().first > enough() && batch.size() < batch_size) {
            std::ranges::pop_heap(open, before);
            batch.push_back(open.back().second);
            open.pop_back();
        }
        made.resize(batch.size());
        work.assign((batch.size() + batch_chunk - 1) / batch_chunk, 0);
        for_chunks(work.size(), threads, [&](std::size_t chunk) {
            Cutter mine = cutter();
            for (std::size_t i = chunk * batch_chunk; i < std::min(batch.size(), (chunk + 1) * batch_chunk);
                 ++i)
                made[i] = mine.cut(pieces[batch[i]]);
            work[chunk] = mine.tests();
        });
        for (const std::uint64_t some : work)
            tests += some;
        for (const auto &halves : made)
            least = std::max({least, reached(halves[0]), reached(halves[1])});
        for (std::size_t i = 0; i < batch.size(); ++i) {
            pieces[batch[i]] = made[i][0];
            keep(batch[i]);
            if (unused.empty()) {
                pieces.push_back(made[i][1]);
                keep(pieces.size() - 1);
            } else {
                const std::size_t other = unused.back();
                unused.pop_back();
                pieces[other] = made[i][1];
                keep(other);
            }
        }
    }
    for (const auto &[most, number] : open)
        settled = std::max(settled, most);
    return {least, std::max(least, settled)};
}

TwoSided two_sided(const Tree &a, const Tree &b, std::uint64_t samples, double gap, double resolution,
                   unsigned threads) {
    const Distance there = one_sided(a, b, samples, threads), back = one_sided(b, a, samples, threads);
    const std::uint64_t tests = 20'000'000 + 200 * (there.near.size() + back.near.size());
    const Closeness closeness{gap, resolution * diagonal(a.surface()), tests};
    const Bounds one = farthest(a, b, there.near, std::max(there.max, back.max), closeness, threads);
    const Bounds other = farthest(b, a, back.near, one.least, closeness, threads);
    return {{other.least, std::max(one.most, other.most)},
            std::max(there.rms, back.rms),
            std::max(there.p99, back.p99)};
}

} // namespace paradize::reference
