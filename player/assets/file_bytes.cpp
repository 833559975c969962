#include "assets/file_bytes.hpp"

#include "error.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <unistd.h>

namespace paradize::assets {

namespace {

constexpr std::size_t part_bytes = std::size_t{1} << 20U;

/// A file that is open for reading.
class Descriptor {
  public:
    explicit Descriptor(const std::filesystem::path &path)
        : number_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) { // a pipe is not waited for
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

/// Size of a regular file that may be read.
std::uint64_t size_of(const Descriptor &file, const std::string &name, std::uint64_t expected) {
    struct stat status {};
    if (::fstat(file.number(), &status) != 0) {
        throw Error(name + ": " + std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        throw Error(name + ": is no regular file" + bake_again);
    }
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (expected != 0 && size != expected) {
        throw Error(name + ": has " + std::to_string(size) + " bytes, scene.json says " +
                    std::to_string(expected) + bake_again);
    }
    if (size == 0) {
        throw Error(name + ": is empty" + bake_again);
    }
    if (size > most_file_bytes) {
        throw Error(name + ": has " + std::to_string(size) + " bytes, at most " +
                    std::to_string(most_file_bytes) + " are taken");
    }
    return size;
}

} // namespace

FileBytes::FileBytes(const std::filesystem::path &path, std::uint64_t expected, const Each &each) {
    const Descriptor file(path);
    const std::string name = path.string();
    room_.emplace(static_cast<std::size_t>(size_of(file, name, expected)));
    const std::span<std::byte> all = room_->bytes();
    for (std::size_t at = 0; at < all.size();) {
        const std::span<std::byte> part = all.subspan(at, std::min(part_bytes, all.size() - at));
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
        if (each) {
            each(part.first(static_cast<std::size_t>(got)));
        }
        at += static_cast<std::size_t>(got);
    }
}

std::span<const std::byte> FileBytes::bytes() const {
    return room_ ? room_->bytes() : std::span<const std::byte>();
}

} // namespace paradize::assets
