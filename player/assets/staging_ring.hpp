#pragma once
// Memory for pieces that wait for their upload: parts of one range, used round and round, or of the heap.

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace paradize::assets {

class StagingRing;

struct FreeStaged {
    StagingRing *ring = nullptr; // nullptr: the bytes are on the heap
    void operator()(std::byte *bytes) const;
};
/// Any thread may free them. The ring must outlive its parts.
using StagedBytes = std::unique_ptr<std::byte[], FreeStaged>;

StagedBytes heap_bytes(std::size_t bytes);

class StagingRing {
  public:
    StagingRing();
    StagingRing(const StagingRing &) = delete;
    StagingRing &operator=(const StagingRing &) = delete;
    ~StagingRing() = default;

    /// From now on parts come from `memory`. Before, and after close(), all come from the heap.
    void open(std::span<std::byte> memory);
    /// False, and does nothing, while parts of the memory are in use.
    bool close();
    /// A part of the memory or, if it has no room until older parts are freed, of the heap. Any thread may
    /// call it. Never waits.
    StagedBytes take(std::size_t bytes);

    static constexpr std::size_t most_parts = 256; // in use at once; more come from the heap

  private:
    friend struct FreeStaged;
    void give_back(const std::byte *bytes);
    std::optional<std::size_t> room(std::size_t bytes) const;

    struct Part {
        std::size_t first = 0, end = 0;
    };
    std::mutex mutex_; // guards all
    std::span<std::byte> memory_;
    std::vector<Part> parts_; // in use, the oldest first
};

} // namespace paradize::assets
