#pragma once
// A file, read whole into memory of its own: whatever happens to the file afterwards, these bytes stay. (A
// mapping would end the program with SIGBUS where the file becomes shorter.)

#include "assets/room.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>

namespace paradize::assets {

class FileBytes {
  public:
    using Each = std::function<void(std::span<const std::byte>)>;

    FileBytes() = default;
    /// `expected`: the size that it must have, 0: any up to most_file_bytes. `each` is called with one part
    /// after the other as it comes, and may throw. Throws Error when the file is missing, no regular file,
    /// empty, of another size, or becomes shorter meanwhile.
    explicit FileBytes(const std::filesystem::path &path, std::uint64_t expected = 0, const Each &each = {});

    std::span<const std::byte> bytes() const;
    /// Gives the memory back; there are no bytes any more.
    void release() { room_.reset(); }

  private:
    std::optional<Room> room_;
};

/// A GLB cannot be larger.
inline constexpr std::uint64_t most_file_bytes = std::uint64_t{1} << 32U;

} // namespace paradize::assets
