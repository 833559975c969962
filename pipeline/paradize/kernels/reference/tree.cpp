#include "reference/tree.hpp"

#include <algorithm>
#include <numeric>

#include "simd/cpu.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t bins = 16;
constexpr unsigned deepest = 40; // from there on ranges are halved, whatever their shape
constexpr double flat = 1e-20;   // squared sine below which a triangle is its edges
constexpr double biggest = std::numeric_limits<double>::max();

// Squared distance of every point of the packet to a triangle; kept where it is the least yet.
[[gnu::always_inline]] inline void measure(const float *corner, double slot, Packet &p) {
    const double ax = corner[0], ay = corner[1], az = corner[2], bx = corner[3], by = corner[4],
                 bz = corner[5], cx = corner[6], cy = corner[7], cz = corner[8];
    const double ux = bx - ax, uy = by - ay, uz = bz - az; // a to b
    const double vx = cx - bx, vy = cy - by, vz = cz - bz; // b to c
    const double wx = ax - cx, wy = ay - cy, wz = az - cz; // c to a
    const double uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz,
                 ww = wx * wx + wy * wy + wz * wz;
    const double iu = uu > 0 ? 1 / uu : 0, iv = vv > 0 ? 1 / vv : 0, iw = ww > 0 ? 1 / ww : 0;
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const double nn = nx * nx + ny * ny + nz * nz;
    const double in = nn > flat * uu * vv ? 1 / nn : -1;
    // Across each side, inwards.
    const double px = ny * uz - nz * uy, py = nz * ux - nx * uz, pz = nx * uy - ny * ux;
    const double qx = ny * vz - nz * vy, qy = nz * vx - nx * vz, qz = nx * vy - ny * vx;
    const double rx = ny * wz - nz * wy, ry = nz * wx - nx * wz, rz = nx * wy - ny * wx;
    for (std::size_t i = 0; i < Packet::size; ++i) {
        const double dx = p.x[i] - ax, dy = p.y[i] - ay, dz = p.z[i] - az;
        const double ex = p.x[i] - bx, ey = p.y[i] - by, ez = p.z[i] - bz;
        const double fx = p.x[i] - cx, fy = p.y[i] - cy, fz = p.z[i] - cz;
        double s = (dx * ux + dy * uy + dz * uz) * iu;
        double t = (ex * vx + ey * vy + ez * vz) * iv;
        double r = (fx * wx + fy * wy + fz * wz) * iw;
        s = s < 0 ? 0 : s > 1 ? 1 : s;
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        r = r < 0 ? 0 : r > 1 ? 1 : r;
        const double gx = dx - s * ux, gy = dy - s * uy, gz = dz - s * uz;
        const double hx = ex - t * vx, hy = ey - t * vy, hz = ez - t * vz;
        const double kx = fx - r * wx, ky = fy - r * wy, kz = fz - r * wz;
        const double g = gx * gx + gy * gy + gz * gz, h = hx * hx + hy * hy + hz * hz,
                     k = kx * kx + ky * ky + kz * kz;
        double d = g < h ? g : h;
        d = k < d ? k : d;
        const double off = nx * dx + ny * dy + nz * dz;
        const double plane = off * off * in;
        const double one = px * dx + py * dy + pz * dz, two = qx * ex + qy * ey + qz * ez,
                     three = rx * fx + ry * fy + rz * fz;
        double inside = one < two ? one : two;
        inside = three < inside ? three : inside;
        inside = in < 0 ? -1 : inside;
        d = inside >= 0 && plane < d ? plane : d;
        const bool nearer = d < p.best[i];
        p.best[i] = nearer ? d : p.best[i];
        p.slot[i] = nearer ? slot : p.slot[i];
    }
}

struct Bounds {
    Point low, high;
};

[[gnu::always_inline]] inline double farthest(const Packet &p) {
    double most = 0;
    for (std::size_t i = 0; i < Packet::size; ++i)
        most = p.best[i] > most ? p.best[i] : most;
    return most;
}

[[gnu::always_inline]] inline bool faces(const float *c, const Point &normal) {
    const double ux = double{c[3]} - c[0], uy = double{c[4]} - c[1], uz = double{c[5]} - c[2];
    const double vx = double{c[6]} - c[0], vy = double{c[7]} - c[1], vz = double{c[8]} - c[2];
    return (uy * vz - uz * vy) * normal[0] + (uz * vx - ux * vz) * normal[1] +
               (ux * vy - uy * vx) * normal[2] >
           0;
}

[[gnu::always_inline]] inline double box_distance(const float *c, const Bounds &p) {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float a = c[axis], b = c[axis + 3], d = c[axis + 6];
        const float low = std::min(a, std::min(b, d)), high = std::max(a, std::max(b, d));
        const double below = low - p.high[axis], above = p.low[axis] - high;
        const double off = below > above ? below : above;
        sum += off > 0 ? off * off : 0;
    }
    return sum;
}

PARADIZE_CLONES std::size_t look(const Tree::Node *nodes, const std::array<float, 9> *corners, Packet &p,
                                 double hint, const Point *facing) {
    Bounds bounds{{biggest, biggest, biggest}, {-biggest, -biggest, -biggest}};
    for (std::size_t i = 0; i < Packet::size; ++i) {
        const Point at{p.x[i], p.y[i], p.z[i]};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            bounds.low[axis] = std::min(bounds.low[axis], at[axis]);
            bounds.high[axis] = std::max(bounds.high[axis], at[axis]);
        }
    }
    const float *first = corners[static_cast<std::size_t>(hint)].data();
    if (facing == nullptr || faces(first, *facing))
        measure(first, hint, p);
    double most = farthest(p);
    std::size_t tests = 0;
    std::array<Tree::Entry, Tree::most_open> open;
    std::size_t depth = 1;
    open[0] = {0, 0};
    while (depth > 0) {
        const Tree::Entry at = open[--depth];
        if (at.distance > most)
            continue;
        if (at.child & Tree::leaf_bit) {
            const std::size_t begin = (at.child & ~Tree::leaf_bit) >> 3, count = at.child & 7;
            bool measured = false;
            for (std::size_t i = begin; i < begin + count; ++i) {
                const float *c = corners[i].data();
                if (box_distance(c, bounds) > most || (facing != nullptr && !faces(c, *facing)))
                    continue;
                measure(c, static_cast<double>(i), p);
                measured = true;
                ++tests;
            }
            if (measured)
                most = farthest(p);
            continue;
        }
        const Tree::Node &node = nodes[at.child];
        double distance[4] = {0, 0, 0, 0};
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t k = 0; k < 4; ++k) {
                const double below = node.low[axis][k] - bounds.high[axis],
                             above = bounds.low[axis] - node.high[axis][k];
                double off = below > above ? below : above;
                off = off > 0 ? off : 0;
                distance[k] += off * off;
            }
        const std::size_t base = depth;
        for (std::size_t k = 0; k < 4; ++k) {
            if (node.child[k] == Tree::empty || distance[k] > most)
                continue;
            std::size_t to = depth++;
            for (; to > base && open[to - 1].distance < distance[k]; --to)
                open[to] = open[to - 1];
            open[to] = {distance[k], node.child[k]};
        }
    }
    return tests;
}

} // namespace

struct Tree::Box {
    std::array<float, 3> low{std::numeric_limits<float>::max(), std::numeric_limits<float>::max(),
                             std::numeric_limits<float>::max()};
    std::array<float, 3> high{std::numeric_limits<float>::lowest(), std::numeric_limits<float>::lowest(),
                              std::numeric_limits<float>::lowest()};
    void add(const float *p) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
        }
    }
    void add(const Box &other) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], other.low[axis]);
            high[axis] = std::max(high[axis], other.high[axis]);
        }
    }
    double half_surface() const {
        const double x = double{high[0]} - low[0], y = double{high[1]} - low[1], z = double{high[2]} - low[2];
        return x * y + y * z + z * x;
    }
};

Tree::Tree(const Surface &surface)
    : surface_(surface), order_(surface.triangles.size() / 3), middles_(order_.size()),
      corners_(order_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (std::size_t t = 0; t < order_.size(); ++t)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = [&](std::size_t k) {
                return surface.positions[surface.triangles[t * 3 + k] * std::size_t{3} + axis];
            };
            middles_[t][axis] = at(0) / 3 + at(1) / 3 + at(2) / 3;
        }
    nodes_.reserve(order_.size() / 4 + 1);
    if (const std::uint64_t root = build({0, order_.size()}, 0); root & leaf_bit) {
        Node node{};
        const Box box = box_of({0, order_.size()});
        std::fill_n(node.child, 4, empty);
        node.child[0] = root;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            node.low[axis][0] = box.low[axis];
            node.high[axis][0] = box.high[axis];
        }
        nodes_.push_back(node);
    }
    for (std::size_t i = 0; i < order_.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                corners_[i][k * 3 + axis] =
                    surface
                        .positions[surface.triangles[order_[i] * std::size_t{3} + k] * std::size_t{3} + axis];
    middles_ = {};
}

Tree::Box Tree::box_of(Range range) const {
    Box box;
    for (std::size_t i = range.first; i < range.stop; ++i)
        for (std::size_t k = 0; k < 3; ++k)
            box.add(&surface_.positions[surface_.triangles[order_[i] * std::size_t{3} + k] * std::size_t{3}]);
    return box;
}

// Where to part a range: between bins along its longest side, where the boxes on both sides cost least.
std::size_t Tree::split(Range range, unsigned depth) {
    Box spread;
    for (std::size_t i = range.first; i < range.stop; ++i)
        spread.add(middles_[order_[i]].data());
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (double{spread.high[k]} - spread.low[k] > double{spread.high[axis]} - spread.low[axis])
            axis = k;
    const double low = spread.low[axis], extent = double{spread.high[axis]} - low;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    const std::size_t half = range.first + (range.stop - range.first) / 2;
    if (depth < deepest && extent > 0) {
        const auto bin = [&](std::uint32_t t) {
            const double share = (middles_[t][axis] - low) / extent * double{bins};
            return std::min(static_cast<std::size_t>(share), bins - 1);
        };
        std::array<Box, bins> boxes;
        std::array<std::size_t, bins> counts{};
        for (std::size_t i = range.first; i < range.stop; ++i) {
            const std::size_t b = bin(order_[i]);
            ++counts[b];
            for (std::size_t k = 0; k < 3; ++k)
                boxes[b].add(
                    &surface_.positions[surface_.triangles[order_[i] * std::size_t{3} + k] * std::size_t{3}]);
        }
        std::array<double, bins> after{};
        Box right;
        std::size_t held = 0;
        for (std::size_t b = bins; b-- > 1;) {
            right.add(boxes[b]);
            held += counts[b];
            after[b] = held > 0 ? right.half_surface() * static_cast<double>(held) : 0;
        }
        Box left;
        held = 0;
        std::size_t best = 0;
        double least = biggest;
        for (std::size_t b = 1; b < bins; ++b) {
            left.add(boxes[b - 1]);
            held += counts[b - 1];
            if (held == 0 || held == range.stop - range.first)
                continue;
            const double cost = left.half_surface() * static_cast<double>(held) + after[b];
            if (cost < least) {
                least = cost;
                best = b;
            }
        }
        if (best > 0) {
            const auto middle = std::stable_partition(at(range.first), at(range.stop),
                                                      [&](std::uint32_t t) { return bin(t) < best; });
            return static_cast<std::size_t>(middle - order_.begin());
        }
    }
    std::nth_element(at(range.first), at(half), at(range.stop), [&](std::uint32_t a, std::uint32_t b) {
        return middles_[a][axis] != middles_[b][axis] ? middles_[a][axis] < middles_[b][axis] : a < b;
    });
    return half;
}

std::uint64_t Tree::build(Range range, unsigned depth) {
    if (range.stop - range.first <= leaf_size)
        return leaf_bit | (range.first << 3) | (range.stop - range.first);
    const std::size_t number = nodes_.size();
    nodes_.emplace_back();
    std::array<Range, 4> parts;
    std::size_t count = 1;
    parts[0] = range;
    while (count < 4) {
        std::size_t largest = 0;
        for (std::size_t k = 1; k < count; ++k)
            if (parts[k].stop - parts[k].first > parts[largest].stop - parts[largest].first)
                largest = k;
        const Range whole = parts[largest];
        if (whole.stop - whole.first <= leaf_size)
            break;
        const std::size_t middle = split(whole, depth);
        parts[largest] = {whole.first, middle};
        parts[count++] = {middle, whole.stop};
    }
    Node node{};
    std::fill_n(node.child, 4, empty);
    for (std::size_t k = 0; k < 4; ++k) {
        Box box;
        if (k < count) {
            box = box_of(parts[k]);
            node.child[k] = build(parts[k], depth + 1);
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            node.low[axis][k] = box.low[axis];
            node.high[axis][k] = box.high[axis];
        }
    }
    nodes_[number] = node;
    return number;
}

std::size_t Tree::nearest(Packet &packet, double hint, const Point *facing) const {
    return look(nodes_.data(), corners_.data(), packet, hint < 0 ? 0 : hint, facing);
}

} // namespace paradize::reference
