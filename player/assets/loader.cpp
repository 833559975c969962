#include "assets/loader.hpp"

#include "assets/payload.hpp"

#include <cstdint>
#include <limits>
#include <utility>

namespace paradize::assets {

namespace {

constexpr std::size_t pieces_ahead = 16; // of at most 1 MiB: bounds the memory that waits
constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

} // namespace

Loader::Loader(std::span<const StreamPiece> pieces, Fetch fetch)
    : fetch_(std::move(fetch)), thread_([this, pieces](const std::stop_token &stop) { load(pieces, stop); }) {
}

Loader::~Loader() {
    thread_.request_stop();
    advance(all);
}

void Loader::advance(std::size_t used) {
    used_.store(used, std::memory_order_release);
    used_.notify_one();
}

void Loader::wait(std::size_t index) const {
    std::size_t ready = ready_.load(std::memory_order_acquire);
    while (ready <= index) {
        ready_.wait(ready, std::memory_order_acquire);
        ready = ready_.load(std::memory_order_acquire);
    }
}

void Loader::load(std::span<const StreamPiece> pieces, const std::stop_token &stop) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        std::size_t used = used_.load(std::memory_order_acquire);
        while (used < i && i - used > pieces_ahead) {
            used_.wait(used, std::memory_order_acquire);
            used = used_.load(std::memory_order_acquire);
        }
        if (stop.stop_requested()) {
            return;
        }
        const StreamPiece &piece = pieces[i];
        if (piece.fetch) {
            fault_ = fetch_(piece.artifact);
        }
        if (piece.inflate != nullptr && fault_.empty()) {
            fault_ = inflater_.inflate(piece.inflate->packed, piece.inflate->room);
            if (fault_.empty()) {
                fault_ = texel_fault(*piece.inflate);
            }
        }
        if (!fault_.empty()) {
            faulty_.store(i, std::memory_order_release);
            ready_.store(all, std::memory_order_release);
            ready_.notify_all();
            return;
        }
        ready_.store(i + 1, std::memory_order_release);
        ready_.notify_all();
    }
}

} // namespace paradize::assets
