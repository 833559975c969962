#pragma once
// Where threads leave pieces for their upload: in a buffer that stays mapped, so that the drawing thread only
// gives commands, or on the heap, from which GL copies at once.

#include "assets/staging_ring.hpp"
#include "gl/buffer.hpp"
#include "gl/mapped_buffer.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace paradize {

/// Parts of a ring that the device may still read, each until a fence behind the commands that read it has
/// passed.
template <class Fence>
class FencedParts {
  public:
    FencedParts() {
        parts_.reserve(assets::StagingRing::most_parts);
        fences_.reserve(assets::StagingRing::most_parts);
    }
    /// All commands that read the part were given.
    void add(assets::StagedBytes part) {
        parts_.push_back(std::move(part));
        ++unfenced_;
    }
    bool needs_fence() const { return unfenced_ != 0; }
    /// `fence` comes after the commands of all parts that were added.
    void put(Fence fence) { fences_.emplace_back(std::move(fence), std::exchange(unfenced_, 0)); }
    /// Frees the parts whose fence has passed.
    void free_passed() {
        while (!fences_.empty() && fences_.front().first.passed()) {
            parts_.erase(parts_.begin(),
                         parts_.begin() + static_cast<std::ptrdiff_t>(fences_.front().second));
            fences_.erase(fences_.begin());
        }
    }

  private:
    std::vector<assets::StagedBytes> parts_;            // the oldest first
    std::vector<std::pair<Fence, std::size_t>> fences_; // and how many parts each frees
    std::size_t unfenced_ = 0;
};

class Staging {
  public:
    /// Makes the buffer, the first time. Without ARB_buffer_storage all pieces stay on the heap.
    void open(std::size_t bytes);
    bool is_open() const { return mapped_.has_value(); }
    /// Deletes the buffer, unless pieces lie in it.
    void close();

    /// Has the memory for pieces, whether the buffer is open or not.
    assets::StagingRing &ring() { return ring_; }
    /// Where GL finds the byte `offset` of a piece.
    gl::Source source(const assets::StagedBytes &staged, std::size_t offset) const;
    /// Takes a piece whose upload commands were all given.
    void finish(assets::StagedBytes staged);
    /// Call these before the first and after the last upload of a frame.
    void begin_frame() { in_use_.free_passed(); }
    void end_frame();

  private:
    bool opened_ = false; // or tried to
    std::optional<gl::MappedBuffer> mapped_;
    assets::StagingRing ring_;
    FencedParts<gl::Fence> in_use_;
};

} // namespace paradize
