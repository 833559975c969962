#pragma once
// Reads a whole file into memory. Later changes of the file do not affect these bytes. (A memory mapping
// would raise SIGBUS if the file became shorter.)

#include "assets/reserved_memory.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace paradize::assets {

/// The limit of the GLB format.
inline constexpr std::uint64_t max_file_bytes = std::uint64_t{1} << 32U;

/// The allowed size of a file.
struct FileSize {
    std::uint64_t exactly = 0; // 0: any size up to `max`
    std::uint64_t max = max_file_bytes;
};

class FileBytes {
  public:
    using OnBytes = std::function<void(std::span<const std::byte>)>;

    FileBytes() noexcept;
    /// Reads the file. `on_bytes` gets each part as it is read, and may throw. Throws Error if the file is
    /// missing, not a regular file, empty, of the wrong size, or truncated while it is read.
    explicit FileBytes(const std::filesystem::path &path, FileSize size = {}, const OnBytes &on_bytes = {});

    FileBytes(FileBytes &&) noexcept;
    FileBytes &operator=(FileBytes &&) noexcept;
    ~FileBytes();

    std::span<const std::byte> bytes() const;
    /// Frees the memory. bytes() is empty afterwards.
    void release();
    /// Frees the memory after the first `keep_bytes` bytes (rounded up to whole pages) until reload(). Keeps
    /// the file open, because it may be deleted meanwhile. Returns false if there is nothing to free. Throws
    /// Error if the file cannot be opened.
    bool release_from(const std::filesystem::path &path, std::size_t keep_bytes);
    /// Reads the freed part again. The kept bytes are not overwritten. `on_bytes` gets the whole file, part
    /// by part. Throws Error like the constructor.
    void reload(const std::string &name, const OnBytes &on_bytes);

  private:
    class Descriptor;
    void read(const Descriptor &file, const std::string &name, const OnBytes &on_bytes);

    std::optional<ReservedMemory> memory_;
    std::unique_ptr<Descriptor> descriptor_; // open while a part is freed
    std::size_t keep_bytes_ = 0;             // bytes that read() does not overwrite
};

} // namespace paradize::assets
