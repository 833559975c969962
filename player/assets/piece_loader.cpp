#include "assets/piece_loader.hpp"

#include <algorithm>
#include <utility>

namespace paradize::assets {

PieceLoader::PieceLoader(std::size_t pieces, Stage stage) : stage_(std::move(stage)), slots_(pieces) {
    orders_.reserve(pieces);
    dropped_.reserve(pieces);
    thread_ = std::jthread([this](const std::stop_token &stop) { work(stop); });
}

PieceLoader::~PieceLoader() = default;

void PieceLoader::order(std::span<const std::uint32_t> pieces) {
    {
        const std::lock_guard lock(mutex_);
        std::swap(orders_, dropped_);
        orders_.assign(pieces.begin(), pieces.end());
        for (const std::uint32_t piece : dropped_) {
            slots_[piece].ordered = false;
        }
        for (const std::uint32_t piece : orders_) {
            slots_[piece].ordered = true;
        }
        for (const std::uint32_t piece : dropped_) {
            if (!slots_[piece].ordered) {
                slots_[piece] = {};
            }
        }
    }
    changed_.notify_all();
}

bool PieceLoader::ready(std::uint32_t piece) const {
    const std::lock_guard lock(mutex_);
    return slots_[piece].ready;
}

StagedPiece PieceLoader::take(std::uint32_t piece) {
    std::unique_lock lock(mutex_);
    if (!slots_[piece].ordered) {
        slots_[piece].ordered = true;
        orders_.insert(orders_.begin(), piece);
        changed_.notify_all();
    }
    changed_.wait(lock, [&] { return slots_[piece].ready; });
    std::erase(orders_, piece);
    return std::exchange(slots_[piece], {}).piece;
}

void PieceLoader::work(const std::stop_token &stop) {
    StageMemory memory;
    std::unique_lock lock(mutex_);
    while (true) {
        auto next = orders_.end();
        const bool go = changed_.wait(lock, stop, [&] {
            next = std::ranges::find_if(orders_, [&](std::uint32_t i) { return !slots_[i].ready; });
            return next != orders_.end();
        });
        if (!go) {
            return;
        }
        const std::uint32_t piece = *next;
        lock.unlock();
        StagedPiece staged = stage_(piece, memory);
        lock.lock();
        if (slots_[piece].ordered) { // else it was cancelled meanwhile
            slots_[piece] = {std::move(staged), true, true};
            changed_.notify_all();
        }
    }
}

} // namespace paradize::assets
