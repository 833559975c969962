#include "reference/draw.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace paradize::reference {

namespace {

constexpr std::uint64_t line_bytes = 64;

// First in, first out: an entry is in the cache as long as fewer than `size` misses came after its own.
class Fifo {
  public:
    Fifo(std::size_t entries, std::uint64_t size) : size_(size), now_(size + 1), came_(entries, 0) {}
    // Whether it missed.
    bool miss(std::size_t entry) {
        if (now_ - came_[entry] <= size_) {
            return false;
        }
        came_[entry] = now_++;
        return true;
    }

  private:
    std::uint64_t size_, now_;
    std::vector<std::uint64_t> came_; // when it came in; 0: never
};

struct Point {
    double x, y, depth; // pixels; the depth grows away from the eye
};

double side_of(const Point &a, const Point &b, double x, double y) {
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

} // namespace

DrawCost draw_cost(std::span<const std::uint32_t> indices, std::size_t vertices, unsigned cache,
                   std::span<const std::uint32_t> strides, std::uint64_t lines) {
    Fifo transformed(vertices, cache);
    std::vector<std::uint64_t> first_line{0};
    std::uint64_t vertex_bytes = 0;
    for (const std::uint32_t stride : strides) {
        first_line.push_back(first_line.back() + (vertices * stride + line_bytes - 1) / line_bytes);
        vertex_bytes += stride;
    }
    Fifo memory(first_line.back(), lines);
    std::vector<bool> used(vertices);
    std::uint64_t transforms = 0, fetched = 0, different = 0;
    for (const std::uint32_t index : indices) {
        if (!used[index]) {
            used[index] = true;
            ++different;
        }
        if (!transformed.miss(index)) {
            continue;
        }
        ++transforms;
        for (std::size_t s = 0; s < strides.size(); ++s) {
            const std::uint64_t start = std::uint64_t{index} * strides[s];
            const std::uint64_t last = (start + strides[s] - 1) / line_bytes;
            for (std::uint64_t line = start / line_bytes; line <= last; ++line) {
                fetched += memory.miss(first_line[s] + line) ? line_bytes : 0;
            }
        }
    }
    DrawCost out;
    if (different > 0) {
        out.acmr = static_cast<double>(transforms) / (static_cast<double>(indices.size()) / 3);
        out.atvr = static_cast<double>(transforms) / static_cast<double>(different);
        const double needed = static_cast<double>(different * std::max<std::uint64_t>(vertex_bytes, 1));
        out.overfetch = static_cast<double>(fetched) / needed;
    }
    return out;
}

double overdraw(std::span<const float> positions, std::span<const std::uint32_t> indices, unsigned side) {
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const std::uint32_t index : indices) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], double{positions[3 * std::size_t{index} + k]});
            high[k] = std::max(high[k], double{positions[3 * std::size_t{index} + k]});
        }
    }
    double extent = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        extent = std::max(extent, high[k] - low[k]);
    }
    if (!(extent > 0)) {
        return 1;
    }
    const double scale = side / extent;
    std::vector<double> depth(std::size_t{side} * side);
    std::uint64_t shaded = 0, covered = 0;
    for (std::size_t view = 0; view < 6; ++view) {
        const std::size_t axis = view / 2, across = (axis + 1) % 3, up = (axis + 2) % 3;
        const bool from_above = view % 2 == 0; // the eye stands on the axis' positive side
        std::ranges::fill(depth, std::numeric_limits<double>::infinity());
        const auto seen = [&](std::uint32_t index) {
            const float *p = positions.data() + 3 * std::size_t{index};
            const double x = (p[across] - low[across]) * scale;
            const double y = (p[up] - low[up]) * scale, z = (p[axis] - low[axis]) * scale;
            // From below the picture is mirrored, so that triangles keep their turn.
            return from_above ? Point{x, y, -z} : Point{side - x, y, z};
        };
        for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
            const Point a = seen(indices[t]), b = seen(indices[t + 1]), c = seen(indices[t + 2]);
            const double area = side_of(a, b, c.x, c.y);
            if (!(area > 0)) {
                continue;
            }
            const double most = side - 1.0;
            const auto from = [&](double v) { return std::clamp(std::ceil(v - 0.5), 0.0, most); };
            const auto to = [&](double v) { return std::clamp(std::floor(v - 0.5), -1.0, most); };
            const double left = from(std::min({a.x, b.x, c.x})), right = to(std::max({a.x, b.x, c.x}));
            const double top = from(std::min({a.y, b.y, c.y})), bottom = to(std::max({a.y, b.y, c.y}));
            for (double row = top; row <= bottom; ++row) {
                for (double column = left; column <= right; ++column) {
                    const double x = column + 0.5, y = row + 0.5;
                    const double wa = side_of(b, c, x, y), wb = side_of(c, a, x, y), wc = side_of(a, b, x, y);
                    if (wa < 0 || wb < 0 || wc < 0) {
                        continue;
                    }
                    const double z = (wa * a.depth + wb * b.depth + wc * c.depth) / area;
                    double &nearest =
                        depth[static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column)];
                    if (z < nearest) {
                        covered += std::isinf(nearest) ? 1 : 0;
                        nearest = z;
                        ++shaded;
                    }
                }
            }
        }
    }
    return covered > 0 ? static_cast<double>(shaded) / static_cast<double>(covered) : 1;
}

} // namespace paradize::reference
