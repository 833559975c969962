#pragma once
// A thread that runs ahead of the upload. It decompresses levels, and reloads file data that was released, so
// that the drawing thread waits neither for Zstandard nor for the disk.

#include "assets/inflate.hpp"
#include "assets/upload_plan.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <thread>

namespace paradize::assets {

class Prefetcher {
  public:
    /// Reloads the released data of an artifact. Returns what went wrong, or an empty text.
    using Reload = std::function<std::string(std::uint32_t artifact)>;

    /// `chunks`, their files and their memory must outlive this object.
    explicit Prefetcher(std::span<const UploadChunk> chunks, Reload reload = {});
    ~Prefetcher();
    Prefetcher(const Prefetcher &) = delete;
    Prefetcher &operator=(const Prefetcher &) = delete;
    /// Reports how many chunks the drawing thread has uploaded.
    void advance(std::size_t used);
    /// True if chunk `index` is in memory and decompressed. Only released or compressed chunks need this
    /// call.
    bool ready(std::size_t index) const { return ready_.load(std::memory_order_acquire) > index; }
    /// Waits until chunk `index` is ready. Call advance() with all chunks before it first.
    void wait(std::size_t index) const;
    /// Call when the chunk is ready. Returns why the chunk could not be loaded or holds invalid texels, or an
    /// empty text. Chunks after an error are never loaded.
    const std::string &error(std::size_t index) const {
        return index == failed_chunk_.load(std::memory_order_acquire) ? error_ : none_;
    }

  private:
    void load(std::span<const UploadChunk> chunks, const std::stop_token &stop);

    std::atomic<std::size_t> used_{0};
    std::atomic<std::size_t> ready_{0};
    std::atomic<std::size_t> failed_chunk_{static_cast<std::size_t>(-1)}; // no chunk
    std::string error_;                                                   // written before failed_chunk_
    const std::string none_;
    const Reload reload_;
    Inflater inflater_;
    std::jthread thread_;
};

} // namespace paradize::assets
