#pragma once
// A thread that is ahead of the upload: it inflates supercompressed levels, and reads again what was given
// back of a large scene, so that the drawing thread waits neither for Zstandard nor for the disk.

#include "assets/inflate.hpp"
#include "assets/stream_plan.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <thread>

namespace paradize::assets {

class Loader {
  public:
    /// Brings the bytes of an artifact that are absent. What is wrong, in full; empty: nothing.
    using Fetch = std::function<std::string(std::uint32_t artifact)>;

    /// `pieces`, their files and their rooms outlive this.
    explicit Loader(std::span<const StreamPiece> pieces, Fetch fetch = {});
    ~Loader();
    Loader(const Loader &) = delete;
    Loader &operator=(const Loader &) = delete;
    /// The drawing thread has used that many pieces.
    void advance(std::size_t used);
    /// Is piece `index` in memory, inflated? Only those that are absent or inflated need to be asked for.
    bool ready(std::size_t index) const { return ready_.load(std::memory_order_acquire) > index; }
    /// Returns when it is. All pieces before it have been told to advance().
    void wait(std::size_t index) const;
    /// Once ready: what is wrong with the piece, when it could not be inflated or holds no numbers; empty:
    /// nothing. Nothing after it comes.
    const std::string &fault(std::size_t index) const {
        return index == faulty_.load(std::memory_order_acquire) ? fault_ : none_;
    }

  private:
    void load(std::span<const StreamPiece> pieces, const std::stop_token &stop);

    std::atomic<std::size_t> used_{0};
    std::atomic<std::size_t> ready_{0};
    std::atomic<std::size_t> faulty_{static_cast<std::size_t>(-1)}; // no piece
    std::string fault_;                                             // written before faulty_
    const std::string none_;
    const Fetch fetch_;
    Inflater inflater_;
    std::jthread thread_;
};

} // namespace paradize::assets
