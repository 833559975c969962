#include "terrain/rtin.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <vector>

#include "parallel.hpp"
#include "terrain/scan.hpp"

namespace paradize::terrain {
namespace {

struct Node { // of the grid
    std::uint32_t x, y;
};

class Grid {
  public:
    Grid(View view, std::uint32_t width, std::uint32_t height, double tolerance)
        : view_(view), tolerance_(tolerance),
          root_(std::bit_floor(std::min(width, height) - 1)), last_{(width - 1) / root_ * root_,
                                                                    (height - 1) / root_ * root_} {
        for (std::uint64_t k = 0; k <= last_.x; ++k) {
            columns_.push_back(static_cast<std::uint16_t>(k * (width - 1) / last_.x));
        }
        for (std::uint64_t k = 0; k <= last_.y; ++k) {
            rows_.push_back(static_cast<std::uint16_t>(k * (height - 1) / last_.y));
        }
        even_ = last_.x == width - 1 && last_.y == height - 1;
        active_.assign(static_cast<std::size_t>(last_.x + 1) * (last_.y + 1), 0);
    }

    // Marks the nodes that must be vertices: from the finest, since what a node needs is coarser.
    void mark(int threads) {
        for (std::uint32_t size = 2; size <= root_; size *= 2) {
            const std::uint32_t half = size / 2;
            // Middles of sides that run along x stand in rows of multiples of `size`, the others in between.
            for_each_job(last_.y / half + 1, threads, [&](std::size_t job) {
                const auto y = static_cast<std::uint32_t>(job) * half;
                for (std::uint32_t x = y % size == 0 ? half : 0; x <= last_.x; x += size) {
                    middle_of_side({x, y}, half, y % size == 0);
                }
            });
            for_each_job(last_.y / size, threads, [&](std::size_t job) {
                const std::uint32_t y = static_cast<std::uint32_t>(job) * size + half;
                for (std::uint32_t x = half; x <= last_.x; x += size) {
                    centre({x, y}, half);
                }
            });
        }
    }

    // The triangles as pixels, three each; row by row of the roots.
    std::vector<std::uint32_t> triangles(std::uint32_t width) {
        std::vector<std::uint32_t> found;
        for (std::uint32_t y = 0; y < last_.y; y += root_) {
            for (std::uint32_t x = 0; x < last_.x; x += root_) {
                const Node a{x, y}, b{x + root_, y}, c{x, y + root_}, d{x + root_, y + root_};
                if (falls(a, root_)) {
                    descend(a, d, c, found);
                    descend(d, a, b, found);
                } else {
                    descend(b, c, a, found);
                    descend(c, b, d, found);
                }
            }
        }
        for (std::uint32_t &pixel : found) {
            pixel = (pixel >> 16) * width + (pixel & 0xffffU);
        }
        return found;
    }

  private:
    View view_;
    double tolerance_;
    std::uint32_t root_; // side of the largest squares, a power of two
    Node last_;
    std::vector<std::uint16_t> columns_, rows_; // of the pixels, per grid column and row
    bool even_;                                 // every pixel is a node
    std::vector<std::uint8_t> active_;

    Pixel spot(Node node) const { return {columns_[node.x], rows_[node.y]}; }
    std::size_t index(Node node) const { return static_cast<std::size_t>(node.y) * (last_.x + 1) + node.x; }
    bool is_active(Node node) const { return active_[index(node)] != 0; }
    void activate(Node node) { // from several threads at once: all write the same
        std::atomic_ref<std::uint8_t>(active_[index(node)]).store(1, std::memory_order_relaxed);
    }
    // Whether the diagonal of the square at `corner` falls to the right: squares about one centre alternate.
    static bool falls(Node corner, std::uint32_t size) { return ((corner.x ^ corner.y) / size) % 2 == 0; }

    bool is_off(Node a, Node b, Node c) const {
        Pixel p = spot(a), q = spot(b);
        const Pixel r = spot(c);
        if (turn(p, q, r) < 0) {
            std::swap(p, q);
        }
        return scan_triangle(view_, p, q, r, tolerance_).pixel != none;
    }

    double off_middle(Pixel a, Pixel b, Pixel middle) const {
        const double low = static_cast<double>(view_.height(a)), high = static_cast<double>(view_.height(b));
        return std::fabs(static_cast<double>(view_.height(middle)) - (low + (high - low) * 0.5));
    }

    void middle_of_side(Node node, std::uint32_t half, bool along_x) {
        const std::uint32_t x = node.x, y = node.y;
        const bool first = along_x ? y > 0 : x > 0, second = along_x ? y < last_.y : x < last_.x;
        const Node before = along_x ? Node{x, y - half} : Node{x - half, y};
        const Node after = along_x ? Node{x, y + half} : Node{x + half, y};
        if (!is_active(node)) {
            const Node a = along_x ? Node{x - half, y} : Node{x, y - half};
            const Node b = along_x ? Node{x + half, y} : Node{x, y + half};
            const bool off = even_ && half == 1
                                 ? off_middle(spot(a), spot(b), spot(node)) > tolerance_
                                 : (first && is_off(a, b, before)) || (second && is_off(a, b, after));
            if (!off) {
                return;
            }
            activate(node);
        }
        if (first) {
            activate(before);
        }
        if (second) {
            activate(after);
        }
    }

    void centre(Node node, std::uint32_t half) {
        const std::uint32_t size = 2 * half;
        const Node a{node.x - half, node.y - half}, b{node.x + half, node.y - half},
            c{node.x - half, node.y + half}, d{node.x + half, node.y + half};
        const bool down = falls(a, size);
        if (!is_active(node)) {
            const bool off = down ? is_off(a, d, c) || is_off(a, d, b) : is_off(b, c, a) || is_off(b, c, d);
            if (!off) {
                return;
            }
            activate(node);
        }
        if (size < root_) { // the corners off the diagonal are middles of the next larger squares' sides
            activate(down ? b : a);
            activate(down ? c : d);
        }
    }

    // a -> b is the longest side, c the right angle; positive turn a, b, c.
    void descend(Node a, Node b, Node c, std::vector<std::uint32_t> &found) const {
        const Node middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
        if ((a.x + b.x) % 2 != 0 || (a.y + b.y) % 2 != 0) { // half a cell
            return leaf(a, b, c, found);
        }
        if (is_active(middle)) {
            descend(c, a, middle, found);
            descend(b, c, middle, found);
            return;
        }
        found.insert(found.end(), {packed(spot(a)), packed(spot(b)), packed(spot(c))});
    }

    // The pixel between two nodes of a finest triangle where it is off their line; `none` where there is
    // none.
    std::uint32_t between(Node a, Node b) const {
        const Pixel p = spot(a), q = spot(b);
        const int dx = p.x > q.x ? p.x - q.x : q.x - p.x, dy = p.y > q.y ? p.y - q.y : q.y - p.y;
        if (dx % 2 != 0 || dy % 2 != 0) {
            return none;
        }
        const Pixel middle{static_cast<std::uint16_t>((p.x + q.x) / 2),
                           static_cast<std::uint16_t>((p.y + q.y) / 2)};
        // Both triangles of a side must see the same number.
        const bool swap = packed(q) < packed(p);
        return off_middle(swap ? q : p, swap ? p : q, middle) > tolerance_ ? packed(middle) : none;
    }

    // Half a cell: its sides may hold a pixel each, its inside none.
    void leaf(Node a, Node b, Node c, std::vector<std::uint32_t> &found) const {
        std::uint32_t corner[3] = {packed(spot(a)), packed(spot(b)), packed(spot(c))};
        std::uint32_t middle[3] = {none, between(b, c), between(c, a)};
        // Across the longest side lies the cell's other half, or a larger triangle, which keeps the bound
        // there.
        const Node d{a.x + b.x - c.x, a.y + b.y - c.y};
        if (root_ == 1 || (is_corner(c) || is_active(c)) == (is_corner(d) || is_active(d))) {
            middle[0] = between(a, b);
        }
        const int count = (middle[0] != none) + (middle[1] != none) + (middle[2] != none);
        if (count == 3) {
            found.insert(found.end(), {corner[0], middle[0], middle[2], middle[0], corner[1], middle[1],
                                       middle[2], middle[1], corner[2], middle[0], middle[1], middle[2]});
            return;
        }
        const auto turned = [&] { // so that the next side comes first
            std::rotate(corner, corner + 1, corner + 3);
            std::rotate(middle, middle + 1, middle + 3);
        };
        if (count == 0) {
            found.insert(found.end(), {corner[0], corner[1], corner[2]});
        } else if (count == 1) {
            while (middle[0] == none) {
                turned();
            }
            found.insert(found.end(), {corner[0], middle[0], corner[2], middle[0], corner[1], corner[2]});
        } else {
            while (middle[2] != none) {
                turned();
            }
            found.insert(found.end(), {middle[0], corner[1], middle[1], corner[0], middle[0], middle[1],
                                       corner[0], middle[1], corner[2]});
        }
    }

    bool is_corner(Node node) const { return node.x % root_ == 0 && node.y % root_ == 0; }
};

} // namespace

Triangulation bisect(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance, int threads) {
    Grid grid({heights.data(), width, heights.data() + heights.size()}, width, height, tolerance);
    grid.mark(threads);
    Triangulation found;
    found.triangles = grid.triangles(width);
    // Vertices are numbered in reading order: the rank of a pixel among those that are used.
    std::vector<std::uint64_t> used((heights.size() + 63) / 64, 0);
    for (const std::uint32_t pixel : found.triangles) {
        used[pixel / 64] |= std::uint64_t{1} << pixel % 64;
    }
    std::vector<std::uint32_t> before(used.size());
    for (std::size_t word = 0; word < used.size(); ++word) {
        before[word] = static_cast<std::uint32_t>(found.pixels.size());
        for (std::uint64_t bits = used[word]; bits != 0; bits &= bits - 1) {
            found.pixels.push_back(
                static_cast<std::uint32_t>(64 * word + static_cast<std::size_t>(std::countr_zero(bits))));
        }
    }
    for (std::uint32_t &pixel : found.triangles) {
        const std::uint64_t below = used[pixel / 64] & ((std::uint64_t{1} << pixel % 64) - 1);
        pixel = before[pixel / 64] + static_cast<std::uint32_t>(std::popcount(below));
    }
    return found;
}

} // namespace paradize::terrain
