#include "assets/prefetcher.hpp"

#include "assets/payload.hpp"

#include <cstdint>
#include <limits>
#include <utility>

namespace paradize::assets {

namespace {

constexpr std::size_t chunks_ahead = 16; // of at most 1 MiB each; limits the memory in use
constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

} // namespace

Prefetcher::Prefetcher(std::span<const UploadChunk> chunks, Reload reload)
    : reload_(std::move(reload)),
      thread_([this, chunks](const std::stop_token &stop) { load(chunks, stop); }) {}

Prefetcher::~Prefetcher() {
    thread_.request_stop();
    advance(all);
}

void Prefetcher::advance(std::size_t used) {
    used_.store(used, std::memory_order_release);
    used_.notify_one();
}

void Prefetcher::wait(std::size_t index) const {
    std::size_t ready = ready_.load(std::memory_order_acquire);
    while (ready <= index) {
        ready_.wait(ready, std::memory_order_acquire);
        ready = ready_.load(std::memory_order_acquire);
    }
}

void Prefetcher::load(std::span<const UploadChunk> chunks, const std::stop_token &stop) {
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        std::size_t used = used_.load(std::memory_order_acquire);
        while (used < i && i - used > chunks_ahead) {
            used_.wait(used, std::memory_order_acquire);
            used = used_.load(std::memory_order_acquire);
        }
        if (stop.stop_requested()) {
            return;
        }
        const UploadChunk &chunk = chunks[i];
        if (chunk.reload) {
            error_ = reload_(chunk.artifact);
        }
        if (chunk.inflate != nullptr && error_.empty()) {
            error_ = inflater_.inflate(chunk.inflate->compressed, chunk.inflate->inflated);
            if (error_.empty()) {
                error_ = texel_error(*chunk.inflate);
            }
        }
        if (!error_.empty()) {
            failed_chunk_.store(i, std::memory_order_release);
            ready_.store(all, std::memory_order_release);
            ready_.notify_all();
            return;
        }
        ready_.store(i + 1, std::memory_order_release);
        ready_.notify_all();
    }
}

} // namespace paradize::assets
