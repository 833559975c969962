#pragma once
// A buffer that other threads fill while the device reads it (ARB_buffer_storage), and fences that tell when
// the device has read.

#include "gl/handle.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <utility>

namespace paradize::gl {

/// A buffer whose memory stays mapped: what any thread writes there, later commands read.
struct MappedBuffer {
    Buffer buffer;
    std::span<std::byte> memory; // readable too

    /// nullopt: the driver lacks ARB_buffer_storage or has no memory for it.
    static std::optional<MappedBuffer> make(std::size_t bytes);
};

/// Tells whether the device has done all commands that were given before it.
class Fence {
  public:
    static Fence behind_all_commands();
    Fence(Fence &&other) noexcept : sync_(std::exchange(other.sync_, nullptr)) {}
    Fence &operator=(Fence &&other) noexcept {
        std::swap(sync_, other.sync_);
        return *this;
    }
    ~Fence();
    /// Does not wait.
    bool passed() const;

  private:
    explicit Fence(void *sync) : sync_(sync) {}
    void *sync_ = nullptr; // GLsync
};

} // namespace paradize::gl
