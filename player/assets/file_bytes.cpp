#include "assets/file_bytes.hpp"

#include "error.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

namespace paradize::assets {

namespace {

constexpr std::size_t part_bytes = std::size_t{1} << 20U;

} // namespace

/// An open file descriptor.
class FileBytes::Descriptor {
  public:
    explicit Descriptor(const std::filesystem::path &path)
        // O_NONBLOCK: opening a pipe does not block
        : number_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
        if (number_ < 0) {
            throw Error(path.string() + ": " + std::strerror(errno));
        }
    }
    ~Descriptor() { ::close(number_); }
    Descriptor(const Descriptor &) = delete;
    Descriptor &operator=(const Descriptor &) = delete;
    int number() const { return number_; }

  private:
    int number_;
};

namespace {

/// Returns the size of a regular file. Throws Error if it is not allowed.
std::uint64_t size_of(int file, const std::string &name, FileSize expected) {
    struct stat status {};
    if (::fstat(file, &status) != 0) {
        throw Error(name + ": " + std::strerror(errno));
    }
    if (S_ISDIR(status.st_mode)) {
        throw Error(name + ": is a folder; move it away" + bake_again);
    }
    if (!S_ISREG(status.st_mode)) {
        throw Error(name + ": is not a regular file" + bake_again);
    }
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (expected.exactly != 0 && size != expected.exactly) {
        throw Error(name + ": has " + std::to_string(size) + " bytes, scene.json says " +
                    std::to_string(expected.exactly) + bake_again);
    }
    if (size == 0) {
        throw Error(name + ": is empty" + bake_again);
    }
    if (size > expected.max) {
        throw Error(name + ": has " + std::to_string(size) + " bytes, the limit is " +
                    std::to_string(expected.max));
    }
    return size;
}

} // namespace

FileBytes::FileBytes(const std::filesystem::path &path, FileSize size, const OnBytes &on_bytes) {
    const Descriptor file(path);
    memory_.emplace(static_cast<std::size_t>(size_of(file.number(), path.string(), size)));
    read(file, path.string(), on_bytes);
}

FileBytes::FileBytes() noexcept = default;
FileBytes::FileBytes(FileBytes &&) noexcept = default;
FileBytes &FileBytes::operator=(FileBytes &&) noexcept = default;
FileBytes::~FileBytes() = default;

void FileBytes::read(const Descriptor &file, const std::string &name, const OnBytes &on_bytes) {
    const std::span<std::byte> all = memory_->bytes();
    std::vector<std::byte> unwritten(std::min(keep_bytes_, part_bytes));
    for (std::size_t at = 0; at < all.size();) {
        const bool is_kept = at < keep_bytes_;
        const std::size_t max = std::min(part_bytes, (is_kept ? keep_bytes_ : all.size()) - at);
        const std::span<std::byte> part = is_kept ? std::span(unwritten).first(max) : all.subspan(at, max);
        const ssize_t got = ::pread(file.number(), part.data(), part.size(), static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            throw Error(name + ": byte " + std::to_string(at) + ": " + std::strerror(errno));
        }
        if (got == 0) {
            throw Error(name + ": ended at byte " + std::to_string(at) + " of " + std::to_string(all.size()) +
                        " while it was read" + bake_again);
        }
        if (on_bytes) {
            on_bytes(part.first(static_cast<std::size_t>(got)));
        }
        at += static_cast<std::size_t>(got);
    }
}

void FileBytes::release() {
    memory_.reset();
    descriptor_.reset();
}

bool FileBytes::release_from(const std::filesystem::path &path, std::size_t keep_bytes) {
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    keep_bytes = (keep_bytes + page - 1) / page * page;
    if (keep_bytes >= memory_->bytes().size()) {
        return false;
    }
    descriptor_ = std::make_unique<Descriptor>(path);
    keep_bytes_ = keep_bytes;
    memory_->release_from(keep_bytes);
    return true;
}

void FileBytes::reload(const std::string &name, const OnBytes &on_bytes) {
    if (descriptor_) {
        read(*descriptor_, name, on_bytes);
        descriptor_.reset();
    }
}

std::span<const std::byte> FileBytes::bytes() const {
    return memory_ ? memory_->bytes() : std::span<const std::byte>();
}

} // namespace paradize::assets
