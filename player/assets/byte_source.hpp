#pragma once
// Where the bytes of an artifact come from. All reading during playback goes through this interface.

#include "error.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::assets {

/// The bytes are gone, or are no longer those that were checked.
class SourceError : public Error {
    using Error::Error;
};

class ByteSource {
  public:
    virtual ~ByteSource() = default;
    /// Reads out.size() bytes from `offset` on. May wait; called on loader threads only.
    /// Throws SourceError.
    virtual void read(std::uint64_t offset, std::span<std::byte> out) const = 0;

  protected:
    ByteSource() = default;
    ByteSource(const ByteSource &) = default;
    ByteSource &operator=(const ByteSource &) = default;
    ByteSource(ByteSource &&) = default;
    ByteSource &operator=(ByteSource &&) = default;
};

} // namespace paradize::assets
