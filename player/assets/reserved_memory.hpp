#pragma once
// Address space for bytes to come: it takes memory only where it is written.

#include <cstddef>
#include <span>

namespace paradize::assets {

class ReservedMemory {
  public:
    /// `size` > 0. Throws Error when the system has no address space left.
    explicit ReservedMemory(std::size_t size);
    ~ReservedMemory();
    ReservedMemory(ReservedMemory &&other) noexcept;
    ReservedMemory &operator=(ReservedMemory &&other) noexcept;
    std::span<std::byte> bytes() const { return {data_, size_}; }
    /// Gives the memory back; the space stays, and reads as zero.
    void release() const { release_from(0); }
    /// The same of what lies behind the first `kept` bytes, whole pages.
    void release_from(std::size_t keep_bytes) const;

  private:
    std::byte *data_ = nullptr;
    std::size_t size_ = 0;
};

} // namespace paradize::assets
