#pragma once
// A file mapped read-only.

#include <cstddef>
#include <filesystem>
#include <span>

namespace paradize::assets {

class MappedFile {
  public:
    MappedFile() noexcept = default;
    /// Throws Error when the file is missing, no regular file, or empty.
    explicit MappedFile(const std::filesystem::path &path);
    MappedFile(MappedFile &&other) noexcept;
    MappedFile &operator=(MappedFile &&other) noexcept;
    MappedFile(const MappedFile &) = delete;
    MappedFile &operator=(const MappedFile &) = delete;
    ~MappedFile();

    std::span<const std::byte> bytes() const { return {data_, size_}; }
    /// Lets the kernel take the pages back; they are read again from the file when touched.
    void release_pages() const;

  private:
    const std::byte *data_ = nullptr;
    std::size_t size_ = 0;
};

} // namespace paradize::assets
