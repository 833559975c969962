#pragma once
// Reserved address space. It uses physical memory only where it is written.

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace paradize::assets {

class ReservedMemory {
  public:
    /// `size` must be above 0. Throws Error if the system has no address space left.
    explicit ReservedMemory(std::size_t size);
    /// Memories of `sizes` bytes, each above 0, in one range: a range for each takes the system longer. Empty
    /// if there is no range so large.
    static std::vector<ReservedMemory> side_by_side(std::span<const std::size_t> sizes);
    /// Frees the physical memory. The range goes with the last memory in it: to cut it, too, takes longer.
    ~ReservedMemory();
    ReservedMemory(ReservedMemory &&other) noexcept = default;
    ReservedMemory &operator=(ReservedMemory &&other) noexcept;
    std::span<std::byte> bytes() const { return {data_, size_}; }
    /// Takes physical memory for a part that is about to be written, at once and not page by page. Where the
    /// system cannot (before Linux 5.14, or the part begins inside a page), writing takes it.
    void populate(std::span<std::byte> part) const;
    /// Frees the physical memory. The address space stays reserved and reads as zero.
    void release() const;

  private:
    class Range;
    ReservedMemory(std::shared_ptr<const Range> range, std::byte *data, std::size_t size);

    std::shared_ptr<const Range> range_; // nullptr after a move
    std::byte *data_ = nullptr;
    std::size_t size_ = 0;
};

} // namespace paradize::assets
