#pragma once
// A thread that is ahead of the upload: it inflates supercompressed levels, and reads again what was given
// back of a large scene, so that the drawing thread waits neither for Zstandard nor for the disk.

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
    /// Brings the bytes of an artifact that are absent. What is wrong, in full; empty: nothing.
    using Reload = std::function<std::string(std::uint32_t artifact)>;

    /// `pieces`, their files and their rooms outlive this.
    explicit Prefetcher(std::span<const UploadChunk> chunks, Reload reload = {});
    ~Prefetcher();
    Prefetcher(const Prefetcher &) = delete;
    Prefetcher &operator=(const Prefetcher &) = delete;
    /// The drawing thread has used that many pieces.
    void advance(std::size_t used);
    /// Is piece `index` in memory, inflated? Only those that are absent or inflated need to be asked for.
    bool ready(std::size_t index) const { return ready_.load(std::memory_order_acquire) > index; }
    /// Returns when it is. All pieces before it have been told to advance().
    void wait(std::size_t index) const;
    /// Once ready: what is wrong with the piece, when it could not be inflated or holds no numbers; empty:
    /// nothing. Nothing after it comes.
    const std::string &error(std::size_t index) const {
        return index == failed_chunk_.load(std::memory_order_acquire) ? error_ : none_;
    }

  private:
    void load(std::span<const UploadChunk> chunks, const std::stop_token &stop);

    std::atomic<std::size_t> used_{0};
    std::atomic<std::size_t> ready_{0};
    std::atomic<std::size_t> failed_chunk_{static_cast<std::size_t>(-1)}; // no piece
    std::string error_;                                                   // written before faulty_
    const std::string none_;
    const Reload reload_;
    Inflater inflater_;
    std::jthread thread_;
};

} // namespace paradize::assets
