// Edges by cost, in buckets that are each 1/32 of their cost wide.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "simplify_mesh.hpp"

namespace paradize::simplify {

// Every edge is in at most one bucket: lists through one array, nothing is allocated after the start.
class Queue {
  public:
    explicit Queue(std::size_t edges) : head(buckets, none), link(edges, none) {}

    static std::uint32_t bucket(double cost) {
        const float small = static_cast<float>(std::min(std::max(cost, 1e-37), 1e37));
        return std::bit_cast<std::uint32_t>(small) >> shift;
    }
    void push(std::uint32_t edge, std::uint32_t into) {
        link[edge] = head[into];
        head[into] = edge;
        lowest = std::min(lowest, into);
    }
    // The edge put in last among those of the lowest bucket, or none; `from` is that bucket.
    std::uint32_t pop(std::uint32_t &from) {
        while (lowest < buckets && head[lowest] == none) {
            ++lowest;
        }
        from = lowest;
        if (lowest == buckets) {
            return none;
        }
        const std::uint32_t edge = head[lowest];
        head[lowest] = link[edge];
        return edge;
    }

  private:
    static constexpr std::uint32_t shift = 18; // five bits of the mantissa stay
    static constexpr std::uint32_t buckets = 0x7f800000u >> shift;
    std::vector<std::uint32_t> head;
    std::vector<std::uint32_t> link;
    std::uint32_t lowest = buckets;
};

} // namespace paradize::simplify
