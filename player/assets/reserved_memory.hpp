#pragma once
// Reserved address space. It uses physical memory only where it is written.

#include <cstddef>
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
    ~ReservedMemory();
    ReservedMemory(ReservedMemory &&other) noexcept;
    ReservedMemory &operator=(ReservedMemory &&other) noexcept;
    std::span<std::byte> bytes() const { return {data_, size_}; }
    /// Takes physical memory for a part that is about to be written, at once and not page by page. Where the
    /// system cannot (before Linux 5.14, or the part begins inside a page), writing takes it.
    void populate(std::span<std::byte> part) const;
    /// Frees the physical memory. The address space stays reserved and reads as zero.
    void release() const;

  private:
    ReservedMemory(std::byte *data, std::size_t size) : data_(data), size_(size) {}

    std::byte *data_ = nullptr;
    std::size_t size_ = 0;
};

} // namespace paradize::assets
