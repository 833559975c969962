#include "reference/draw.hpp"

#include <algorithm>
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

} // namespace paradize::reference
