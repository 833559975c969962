// Edges by cost, in buckets of an octave; those of one bucket come in order of their numbers.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "simplify/mesh.hpp"

namespace paradize::simplify {

// Every edge is in at most one bucket: lists through one array. A bucket is taken out whole and sorted, so
// that edges that lie side by side in the mesh are met one after another.
class Queue {
  public:
    Queue() : bins(buckets) {}

    static std::uint32_t bucket(double cost) {
        const float small = static_cast<float>(std::max(std::min(1e37, cost), 1e-37)); // NaN: 1e37
        return std::bit_cast<std::uint32_t>(small) >> shift;
    }
    void push(std::uint32_t edge, std::uint32_t into) {
        bins[into].push_back(edge);
        lowest = std::min(lowest, into);
    }
    // The next edge of the lowest bucket, or none; `from` is its bucket.
    std::uint32_t pop(std::uint32_t &from) {
        if (at == batch.size()) {
            while (lowest < buckets && bins[lowest].empty()) {
                ++lowest;
            }
            if (lowest == buckets) {
                return none;
            }
            at = 0;
            batch.clear();
            batch.swap(bins[lowest]);
            current = lowest;
            std::sort(batch.begin(), batch.end());
        }
        from = current;
        return batch[at++];
    }

    // An edge that comes after so many others, or the bucket's last.
    std::uint32_t ahead(std::size_t others) const { return batch[std::min(at + others, batch.size() - 1)]; }

  private:
    static constexpr std::uint32_t shift = 23;
    static constexpr std::uint32_t buckets = 0x7f800000u >> shift;
    std::vector<std::vector<std::uint32_t>> bins;
    std::uint32_t lowest = buckets;
    std::vector<std::uint32_t> batch;
    std::size_t at = 0;
    std::uint32_t current = 0;
};

} // namespace paradize::simplify
