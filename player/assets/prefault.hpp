#pragma once
// A thread that touches mapped pages ahead of the upload, so that the drawing thread never waits for the
// disk.

#include "assets/stream_plan.hpp"

#include <atomic>
#include <cstddef>
#include <span>
#include <thread>

namespace paradize::assets {

class Prefault {
  public:
    /// `pieces` and their mappings outlive this.
    explicit Prefault(std::span<const StreamPiece> pieces);
    ~Prefault();
    Prefault(const Prefault &) = delete;
    Prefault &operator=(const Prefault &) = delete;
    /// The drawing thread has used that many pieces.
    void advance(std::size_t used);

  private:
    void touch(std::span<const StreamPiece> pieces, const std::stop_token &stop);

    std::atomic<std::size_t> used_{0};
    std::jthread thread_;
};

} // namespace paradize::assets
