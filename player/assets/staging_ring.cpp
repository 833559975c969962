#include "assets/staging_ring.hpp"

#include <algorithm>

namespace paradize::assets {

namespace {

constexpr std::size_t alignment = 64; // of parts: no two threads write into one cache line

} // namespace

void FreeStaged::operator()(std::byte *bytes) const {
    if (ring == nullptr) {
        delete[] bytes;
    } else {
        ring->give_back(bytes);
    }
}

StagedBytes heap_bytes(std::size_t bytes) {
    return StagedBytes(std::make_unique_for_overwrite<std::byte[]>(bytes).release());
}

StagingRing::StagingRing() {
    parts_.reserve(most_parts);
}

void StagingRing::open(std::span<std::byte> memory) {
    const std::lock_guard lock(mutex_);
    memory_ = memory;
}

bool StagingRing::close() {
    const std::lock_guard lock(mutex_);
    if (!parts_.empty()) {
        return false;
    }
    memory_ = {};
    return true;
}

StagedBytes StagingRing::take(std::size_t bytes) {
    {
        const std::lock_guard lock(mutex_);
        const std::size_t aligned = (std::max(bytes, std::size_t{1}) + alignment - 1) / alignment * alignment;
        if (const std::optional<std::size_t> first = room(aligned)) {
            parts_.push_back({*first, *first + aligned});
            return {memory_.data() + *first, FreeStaged{this}};
        }
    }
    return heap_bytes(bytes);
}

/// Returns where the next part begins, behind the youngest or, if that is near the end, at 0.
std::optional<std::size_t> StagingRing::room(std::size_t bytes) const {
    const std::size_t first = parts_.empty() ? 0 : parts_.front().first; // of what is in use
    const std::size_t end = parts_.empty() ? 0 : parts_.back().end;
    const bool wrapped = !parts_.empty() && end <= first;
    if (parts_.size() == most_parts) {
        return std::nullopt;
    }
    if ((wrapped ? first : memory_.size()) - end >= bytes) {
        return end;
    }
    return !wrapped && first >= bytes ? std::optional<std::size_t>(0) : std::nullopt;
}

void StagingRing::give_back(const std::byte *bytes) {
    const std::lock_guard lock(mutex_);
    const auto first = static_cast<std::size_t>(bytes - memory_.data());
    parts_.erase(std::ranges::find(parts_, first, &Part::first));
}

} // namespace paradize::assets
