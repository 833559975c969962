#include "assets/prefault.hpp"

#include <cstdint>
#include <limits>

namespace paradize::assets {

namespace {

constexpr std::size_t page_bytes = 4096;
constexpr std::size_t pieces_ahead = 16; // of at most 1 MiB: bounds the memory that waits

} // namespace

Prefault::Prefault(std::span<const StreamPiece> pieces)
    : thread_([this, pieces](const std::stop_token &stop) { touch(pieces, stop); }) {}

Prefault::~Prefault() {
    thread_.request_stop();
    advance(std::numeric_limits<std::size_t>::max());
}

void Prefault::advance(std::size_t used) {
    used_.store(used, std::memory_order_release);
    used_.notify_one();
}

void Prefault::touch(std::span<const StreamPiece> pieces, const std::stop_token &stop) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        std::size_t used = used_.load(std::memory_order_acquire);
        while (used < i && i - used > pieces_ahead) {
            used_.wait(used, std::memory_order_acquire);
            used = used_.load(std::memory_order_acquire);
        }
        if (stop.stop_requested()) {
            return;
        }
        if (used > i) {
            continue;
        }
        const volatile std::byte *bytes = pieces[i].bytes.data();
        for (std::size_t at = 0; at < pieces[i].bytes.size(); at += page_bytes) {
            static_cast<void>(bytes[at]);
        }
    }
}

} // namespace paradize::assets
