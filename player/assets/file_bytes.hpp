#pragma once
// Reads a file into memory: its front first, the rest later, or all at once. Later changes of the file do not
// affect these bytes. (A memory mapping would raise SIGBUS if the file became shorter.) Or the file is read
// to be checked alone, without memory for all of it, or its memory is freed afterwards: then it stays open,
// or is opened again, and parts are read when they are needed.

#include "assets/byte_source.hpp"
#include "assets/reserved_memory.hpp"

#include <array>
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

/// Identifies a version of a file: device, inode, size, modification and change time in nanoseconds. All zero
/// if there is no file.
using FileStamp = std::array<std::int64_t, 5>;
FileStamp stamp_of(const std::filesystem::path &file);
/// The clock of time stamps, nanoseconds since 1970.
std::int64_t now_ns();

class FileBytes final : public ByteSource {
  public:
    using OnBytes = std::function<void(std::span<const std::byte>)>;

    FileBytes() noexcept;
    /// Reads the file. `on_bytes` gets each part as it is read, and may throw. Throws Error if the file is
    /// missing, not a regular file, empty, of the wrong size, or truncated while it is read.
    explicit FileBytes(const std::filesystem::path &path, FileSize size = {}, const OnBytes &on_bytes = {});

    /// Reserves memory for the file and reads its first 4 KiB, which hold most headers: opening a file again
    /// takes longer. memory: of the size that the file must have; std::nullopt: it is made. Throws Error like
    /// the constructor.
    static FileBytes reserve(const std::filesystem::path &path, FileSize size = {},
                             std::optional<ReservedMemory> memory = std::nullopt);
    /// Reads at least the first `bytes` bytes, unless it did before, and at most the whole file. bytes() is
    /// zero behind them. Throws Error.
    void read_front(const std::filesystem::path &path, std::size_t bytes);
    /// Reads the whole file. Throws Error, also if the front differs from what read_front() found.
    void read_all(const std::filesystem::path &path, const OnBytes &on_bytes);
    /// Reads the whole file for `on_bytes` alone and keeps it open for read(), as if its memory was freed.
    /// False, and read_all() is needed, if the file was changed in the last 3 s, or while it was read: a
    /// change after that might not alter its time stamp. Throws Error like read_all().
    bool read_through(const std::filesystem::path &path, const OnBytes &on_bytes);

    FileBytes(FileBytes &&) noexcept;
    FileBytes &operator=(FileBytes &&) noexcept;
    ~FileBytes() override;

    /// The file's bytes. After free_memory() the addresses are valid, but their content is zero.
    std::span<const std::byte> bytes() const;
    bool in_memory() const { return !descriptor_ && !opens_again_; }
    bool is_open() const { return descriptor_ != nullptr; }
    /// The version of the file that was read or opened last. Zero if it was so young then that a change might
    /// not alter its times.
    const FileStamp &stamp() const { return stamp_; }
    /// Keeps the file open for read() and frees the memory, as if it was read. False, and nothing is done, if
    /// it is not that version, its front is not what read_front() found, or it cannot be opened.
    bool keep_open(const std::filesystem::path &path, const FileStamp &version);
    /// Frees the memory and closes the file. bytes() is empty afterwards.
    void release();
    /// Frees the memory. If it `may_stay_open` the file is kept open for read(), because it may be deleted
    /// meanwhile, else read() opens it again. `on_bytes` gets the whole file once more if the file is so
    /// young that a change would not alter its time stamp; it may throw. Throws Error if the file has changed
    /// since it was read.
    void free_memory(const std::filesystem::path &path, const OnBytes &on_bytes, bool may_stay_open = true);
    /// Copies from memory, or reads the open file, or one that it opens. Throws SourceError if the file has
    /// become shorter or was changed since it was checked, and if it cannot be opened again.
    void read(std::uint64_t offset, std::span<std::byte> out) const override;

  private:
    class Descriptor;
    void read_front(const Descriptor &file, std::size_t bytes);
    void read_all(const Descriptor &file, const OnBytes &on_bytes);
    void check_front(std::span<const std::byte> found) const;
    /// Throws Error if that is not the stamp of the file that was checked.
    void require_same(const FileStamp &found) const;

    std::optional<ReservedMemory> memory_;
    std::unique_ptr<Descriptor> descriptor_; // open while the memory is freed
    bool opens_again_ = false;               // the memory is freed, and the file is not open
    std::string name_;
    std::size_t front_ = 0; // bytes that read_front() has read
    FileStamp stamp_{};     // of the file whose bytes were checked
};

} // namespace paradize::assets
