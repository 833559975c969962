#include "reference/bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/cover.hpp"
#include "reference/distance.hpp"
#include "reference/samples.hpp"

namespace paradize::reference {
namespace {

// Triangles, and pieces of them, that one thread looks at in a row; fixed, so that results do not depend on
// threads.
constexpr std::size_t chunk_places = 256, few = 16;
constexpr std::size_t patience = 32; // pieces of each triangle or piece that a chunk looks at in one round
constexpr std::size_t most_open = 250'000; // pieces up to which rounds go to the farthest: 54 MB each copy
constexpr std::uint64_t look_up = 16;      // tests that a place's look-up in the tree counts for at least
constexpr std::uint64_t side_by_side = 4;  // of the tests of a look-up of Packet::size places side by side
constexpr double rounding = 1e-14;         // of distances, as a share of them: smaller differences are none
constexpr double infinite = std::numeric_limits<double>::infinity();

// The bound from which on a place is looked at no more, where some place is known to lie `least` away.
double enough(double least, const Closeness &closeness) {
    return least + std::max(closeness.gap * least, closeness.resolution);
}

// A part of a triangle of `from`.
struct Piece {
    Polygon at;
    std::uint32_t slot = 0; // in the tree, of the triangle of `to` that it is held against next
    bool looked_up = false; // the triangle is the nearest to the piece's middle
    double most = infinite; // no point of it lies farther
};

// One thread's work on the pieces of one chunk.
class Work {
  public:
    // goal: pieces that are known to be nearer wait for a later round.
    Work(const Tree &to, double least, double goal, const Closeness &closeness)
        : to_(to), closeness_(closeness), least_(least), goal_(goal) {}

    double least() const { return least_; }
    double settled() const { return settled_; }
    std::uint64_t tests() const { return tests_; }

    void add(const Piece &piece) { (piece.most < goal_ ? later_ : open_).push_back(piece); }
    // Looks at so many pieces at most, the last ones first, until about so many tests are made.
    void run(std::size_t pieces, std::uint64_t tests) {
        while (!open_.empty() && pieces > 0 && tests_ < tests) {
            const std::size_t count = std::min({open_.size(), Packet::size, pieces});
            std::array<Piece, Packet::size> held;
            std::copy(open_.end() - static_cast<std::ptrdiff_t>(count), open_.end(), held.begin());
            open_.resize(open_.size() - count);
            look_up_all({held.data(), count});
            for (std::size_t i = count; i-- > 0;)
                look(held[i]);
            pieces -= count;
        }
    }
    // Appends the pieces left.
    void leave(std::vector<Piece> &to) const {
        to.insert(to.end(), later_.begin(), later_.end());
        to.insert(to.end(), open_.begin(), open_.end());
    }

  private:
    // Up to where parts are cut away: no farther than must be, so that the bound is tight where it can be.
    double near() const { return std::max(least_ * (1 + rounding), closeness_.resolution); }
    void look_up_all(std::span<Piece> pieces);
    void look(const Piece &piece);

    const Tree &to_;
    const Closeness &closeness_;
    double least_;
    double goal_;
    double settled_ = 0; // the largest bound of what is not looked at any more
    std::uint64_t tests_ = 0;
    std::vector<Piece> open_, later_;
};

// Finds the triangles nearest to the middles, whose distances some point of the surface has.
void Work::look_up_all(std::span<Piece> pieces) {
    Packet packet;
    std::size_t count = 0;
    std::array<Piece *, Packet::size> asked;
    for (Piece &piece : pieces) {
        if (piece.looked_up)
            continue;
        const Point p = middle(piece.at);
        packet.x[count] = p[0];
        packet.y[count] = p[1];
        packet.z[count] = p[2];
        packet.best[count] = Target(to_.corners(piece.slot)).squared(p);
        asked[count++] = &piece;
    }
    if (count == 0)
        return;
    for (std::size_t i = count; i < Packet::size; ++i) {
        packet.x[i] = packet.x[0];
        packet.y[i] = packet.y[0];
        packet.z[i] = packet.z[0];
        packet.best[i] = packet.best[0];
    }
    packet.slot.fill(-1);
    const std::uint64_t tested = to_.nearest(packet, asked[0]->slot, nullptr);
    for (std::size_t i = 0; i < count; ++i) {
        if (packet.slot[i] >= 0)
            asked[i]->slot = static_cast<std::uint32_t>(packet.slot[i]);
        asked[i]->looked_up = true;
        least_ = std::max(least_, std::sqrt(packet.best[i]));
    }
    tests_ += std::max(count * look_up, tested * side_by_side);
}

void Work::look(const Piece &piece) {
    const ClippedPolygon rest = beyond(piece.at, Target(to_.corners(piece.slot)), near());
    tests_ += piece.at.count;
    const double most = std::min(piece.most, rest.farthest);
    if (most <= enough(least_, closeness_)) {
        settled_ = std::max(settled_, most);
        return;
    }
    if (most < goal_) {
        later_.push_back({piece.at, piece.slot, piece.looked_up, most});
        return;
    }
    if (rest.worth) {
        settled_ = std::max(settled_, rest.near);
        for (std::size_t i = 0; i < rest.count; ++i)
            add({rest.parts[i], piece.slot, false, most});
        return;
    }
    for (const Polygon &half : halves(piece.at))
        add({half, piece.slot, false, most});
}

double diagonal(const Surface &surface) {
    Point low{infinite, infinite, infinite}, high{-infinite, -infinite, -infinite};
    for (const std::uint32_t vertex : surface.triangles)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double value = surface.positions[vertex * std::size_t{3} + axis];
            low[axis] = std::min(low[axis], value);
            high[axis] = std::max(high[axis], value);
        }
    const Point across = minus(high, low);
    return std::sqrt(dot(across, across));
}

} // namespace

Bounds farthest(const Tree &from, const Tree &to, std::span<const std::uint32_t> near, double least,
                const Closeness &closeness, unsigned threads) {
    double settled = 0, most = infinite;
    std::uint64_t tests = 0;
    std::vector<Piece> open;
    // Every chunk starts from what was known before the round, whichever thread has it.
    const auto round = [&](std::size_t count, std::size_t size, double goal, std::uint64_t until,
                           const auto &piece) {
        const std::size_t chunks = (count + size - 1) / size; // not 0: a surface has a triangle
        const std::uint64_t each = std::max<std::uint64_t>((until - tests) / chunks, 1);
        std::vector<Work> works(chunks, Work(to, least, goal, closeness));
        for_chunks(chunks, threads, [&](std::size_t chunk) {
            Work &work = works[chunk];
            const std::size_t first = chunk * size, stop = std::min(count, first + size);
            for (std::size_t i = stop; i-- > first;)
                work.add(piece(i));
            work.run((stop - first) * patience, each);
        });
        open.clear();
        for (const Work &work : works) {
            least = std::max(least, work.least());
            settled = std::max(settled, work.settled());
            tests += work.tests();
            work.leave(open);
        }
        most = 0;
        for (const Piece &left : open)
            most = std::max(most, left.most);
    };
    const auto next_round = [&](double goal, std::uint64_t until) {
        const std::vector<Piece> before = std::move(open);
        round(before.size(), few, goal, until, [&](std::size_t i) { return before[i]; });
    };
    // Half of the tests go into one place after another, which is the quickest where they are enough. The
    // others go to what may lie farthest, so that all of it is known to be near when they end; but for
    // memory's sake not where so many pieces are open.
    const std::uint64_t half = closeness.tests / 2;
    round(near.size(), chunk_places, 0, half, [&](std::size_t place) {
        const std::uint32_t i = from.order()[place];
        Piece piece{{}, near[i], true, infinite};
        for (const Point &corner : corners_of(from.surface(), i))
            piece.at.add(corner);
        return piece;
    });
    while (!open.empty() && tests < half)
        next_round(0, half);
    if (most == infinite)
        next_round(infinite, ~std::uint64_t{0});
    while (most > enough(least, closeness) && tests < closeness.tests)
        next_round(open.size() < most_open ? most / 2 : 0, closeness.tests);
    settled = std::max(settled, most);
    return {least, settled > least * (1 + rounding) ? settled : least};
}

TwoSided two_sided(const Tree &a, const Tree &b, std::uint64_t samples, double gap, double resolution,
                   unsigned threads) {
    const Distance there = one_sided(a, b, samples, threads), back = one_sided(b, a, samples, threads);
    const std::uint64_t tests = 60'000'000 + 600 * (there.near.size() + back.near.size());
    const Closeness closeness{gap, resolution * diagonal(a.surface()), tests};
    const Bounds one = farthest(a, b, there.near, std::max(there.max, back.max), closeness, threads);
    const Bounds other = farthest(b, a, back.near, one.least, closeness, threads);
    return {{other.least, std::max(one.most, other.most)},
            std::max(there.rms, back.rms),
            std::max(there.p99, back.p99)};
}

} // namespace paradize::reference
