#pragma once
// A file, read whole into memory of its own: whatever happens to the file afterwards, these bytes stay. (A
// mapping would end the program with SIGBUS where the file becomes shorter.)

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

/// A GLB cannot be larger.
inline constexpr std::uint64_t max_file_bytes = std::uint64_t{1} << 32U;

/// The size that a file must have.
struct FileSize {
    std::uint64_t exactly = 0; // 0: any up to `most`
    std::uint64_t max = max_file_bytes;
};

class FileBytes {
  public:
    using OnBytes = std::function<void(std::span<const std::byte>)>;

    FileBytes() noexcept;
    /// `each` is called with one part after the other as it comes, and may throw. Throws Error when the file
    /// is missing, no regular file, empty, of another size, or becomes shorter meanwhile.
    explicit FileBytes(const std::filesystem::path &path, FileSize size = {}, const OnBytes &on_bytes = {});

    FileBytes(FileBytes &&) noexcept;
    FileBytes &operator=(FileBytes &&) noexcept;
    ~FileBytes();

    std::span<const std::byte> bytes() const;
    /// Gives the memory back; there are no bytes any more.
    void release();
    /// Gives the memory back of what lies behind the first `kept` bytes, rounded up to whole pages, until
    /// fetch(). The file stays open: it may be swept meanwhile. False: there is nothing behind them. Throws
    /// Error when it cannot be opened.
    bool release_from(const std::filesystem::path &path, std::size_t keep_bytes);
    /// Reads the file again, for what was given back; the bytes that were kept are not written to. `each` is
    /// called with all of it, part by part. Throws Error as the constructor does.
    void reload(const std::string &name, const OnBytes &on_bytes);

  private:
    class Descriptor;
    void read(const Descriptor &file, const std::string &name, const OnBytes &on_bytes);

    std::optional<ReservedMemory> memory_;
    std::unique_ptr<Descriptor> descriptor_; // while a part is given back
    std::size_t keep_bytes_ = 0;             // bytes that read() leaves as they are
};

} // namespace paradize::assets
