#include "assets/file_bytes.hpp"

#include "error.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace paradize::assets {

namespace {

constexpr std::size_t first_bytes = 4096; // that are read when memory is reserved
constexpr std::size_t part_bytes = std::size_t{1} << 20U;
constexpr std::size_t passing_bytes = std::size_t{1} << 16U; // in memory while a file is read through

// Time stamps come from a clock with steps of up to 10 ms. A file that was younger than this when it was read
// may have changed since without another time stamp.
constexpr std::int64_t young_ns = 20'000'000;
// The time stamps of some file systems have steps of up to 2 s.
constexpr std::int64_t settled_ns = 3'000'000'000;

std::int64_t nanoseconds(const timespec &time) {
    return static_cast<std::int64_t>(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

FileStamp stamp_from(const struct stat &status) {
    return {static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino),
            static_cast<std::int64_t>(status.st_size), nanoseconds(status.st_mtim),
            nanoseconds(status.st_ctim)};
}

/// Links and renames change the last entry, the time of change, but no byte.
bool same_content(const FileStamp &a, const FileStamp &b) {
    return std::equal(a.begin(), a.end() - 1, b.begin());
}

} // namespace

std::int64_t now_ns() {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    return nanoseconds(now);
}

FileStamp stamp_of(const std::filesystem::path &file) {
    struct stat status {};
    return ::stat(file.c_str(), &status) == 0 ? stamp_from(status) : FileStamp{};
}

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
    FileStamp stamp() const {
        struct stat status {};
        return ::fstat(number_, &status) == 0 ? stamp_from(status) : FileStamp{};
    }
    /// Reads up to out.size() bytes at `offset`, at least one. Throws Error at the end of the file.
    std::size_t read_some(std::size_t offset, std::span<std::byte> out, const std::string &name,
                          std::size_t size) const {
        ssize_t got = -1;
        do {
            got = ::pread(number_, out.data(), out.size(), static_cast<off_t>(offset));
        } while (got < 0 && errno == EINTR);
        if (got < 0) {
            throw Error(name + ": byte " + std::to_string(offset) + ": " + std::strerror(errno));
        }
        if (got == 0) {
            throw Error(name + ": ended at byte " + std::to_string(offset) + " of " + std::to_string(size) +
                        " while it was read" + bake_again);
        }
        return static_cast<std::size_t>(got);
    }
    /// Reads all of `out` from `offset` on. Throws Error like read_some().
    void read(std::size_t offset, std::span<std::byte> out, const std::string &name, std::size_t size) const {
        for (std::size_t at = 0; at < out.size();) {
            at += read_some(offset + at, out.subspan(at), name, size);
        }
    }

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

FileBytes::FileBytes(const std::filesystem::path &path, FileSize size, const OnBytes &on_bytes)
    : name_(path.string()) {
    const Descriptor file(path);
    memory_.emplace(static_cast<std::size_t>(size_of(file.number(), name_, size)));
    read_all(file, on_bytes);
}

FileBytes FileBytes::reserve(const std::filesystem::path &path, FileSize size,
                             std::optional<ReservedMemory> memory) {
    FileBytes out;
    out.name_ = path.string();
    const Descriptor file(path);
    const auto bytes = static_cast<std::size_t>(size_of(file.number(), out.name_, size));
    out.memory_ = memory ? std::move(memory) : std::optional<ReservedMemory>(bytes);
    out.read_front(file, first_bytes);
    return out;
}

FileBytes::FileBytes() noexcept = default;
FileBytes::FileBytes(FileBytes &&) noexcept = default;
FileBytes &FileBytes::operator=(FileBytes &&) noexcept = default;
FileBytes::~FileBytes() = default;

void FileBytes::read_all(const Descriptor &file, const OnBytes &on_bytes) {
    const std::int64_t start_ns = now_ns();
    const FileStamp before = file.stamp();
    const std::span<std::byte> all = memory_->bytes();
    const std::vector<std::byte> front(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(front_));
    for (std::size_t at = 0; at < all.size();) {
        const std::span<std::byte> part = all.subspan(at, std::min(part_bytes, all.size() - at));
        memory_->populate(part);
        const std::size_t got = file.read_some(at, part, name_, all.size());
        if (on_bytes) {
            on_bytes(part.first(got));
        }
        at += got;
    }
    check_front(front);
    stamp_ = file.stamp();
    if (stamp_ != before || start_ns - stamp_.back() < young_ns) {
        stamp_ = {}; // no stamp proves that the file is still the same
    }
}

bool FileBytes::read_through(const std::filesystem::path &path, const OnBytes &on_bytes) {
    auto file = std::make_unique<Descriptor>(path);
    const FileStamp before = file->stamp();
    if (now_ns() - before.back() < settled_ns) {
        return false;
    }
    const std::size_t size = bytes().size();
    std::vector<std::byte> memory(std::min(passing_bytes, size));
    std::vector<std::byte> front;
    front.reserve(front_);
    for (std::size_t at = 0; at < size;) {
        std::span<std::byte> part = std::span(memory).first(std::min(passing_bytes, size - at));
        part = part.first(file->read_some(at, part, name_, size));
        on_bytes(part);
        const std::span<std::byte> in_front = part.first(std::min(part.size(), front_ - front.size()));
        front.insert(front.end(), in_front.begin(), in_front.end());
        at += part.size();
    }
    check_front(front);
    if (file->stamp() != before) {
        return false;
    }
    stamp_ = before;
    memory_->release();
    descriptor_ = std::move(file);
    return true;
}

void FileBytes::check_front(std::span<const std::byte> found) const {
    if (!std::ranges::equal(found, bytes().first(front_))) {
        throw Error(name_ + ": was changed while it was read" + bake_again);
    }
}

void FileBytes::read_front(const std::filesystem::path &path, std::size_t bytes) {
    if (front_ < std::min(bytes, memory_->bytes().size())) {
        read_front(Descriptor(path), bytes);
    }
}

void FileBytes::read_front(const Descriptor &file, std::size_t bytes) {
    const std::span<std::byte> all = memory_->bytes();
    const std::size_t end = std::min(bytes, all.size());
    if (front_ < end) {
        file.read(front_, all.subspan(front_, end - front_), name_, all.size());
        front_ = end;
    }
}

void FileBytes::read_all(const std::filesystem::path &path, const OnBytes &on_bytes) {
    const Descriptor file(path);
    read_all(file, on_bytes);
}

void FileBytes::release() {
    memory_.reset();
    descriptor_.reset();
    opens_again_ = false;
}

void FileBytes::free_memory(const std::filesystem::path &path, const OnBytes &on_bytes, bool may_stay_open) {
    if (!memory_) {
        return; // was released
    }
    auto file = std::make_unique<Descriptor>(path);
    const std::int64_t wait_ns = file->stamp().back() + young_ns - now_ns();
    if (stamp_ == FileStamp{} && wait_ns < young_ns) { // a clock that runs ahead is not waited for
        std::this_thread::sleep_for(std::chrono::nanoseconds(std::max<std::int64_t>(wait_ns, 0)));
        read_all(*file, on_bytes);
    }
    if (stamp_ == FileStamp{}) {
        return; // stays in memory
    }
    if (!same_content(stamp_, file->stamp())) {
        throw Error(name_ + ": was changed after it was checked" + bake_again);
    }
    memory_->release();
    opens_again_ = !may_stay_open;
    if (may_stay_open) {
        descriptor_ = std::move(file);
    }
}

bool FileBytes::keep_open(const std::filesystem::path &path, const FileStamp &version) {
    try {
        auto file = std::make_unique<Descriptor>(path);
        std::vector<std::byte> front(front_);
        file->read(0, front, name_, bytes().size());
        if (file->stamp() != version || !std::ranges::equal(front, bytes().first(front_))) {
            return false;
        }
        stamp_ = version;
        memory_->release();
        descriptor_ = std::move(file);
        return true;
    } catch (const Error &) { // told by whoever reads the file instead
        return false;
    }
}

void FileBytes::read(std::uint64_t offset, std::span<std::byte> out) const {
    if (in_memory()) {
        std::ranges::copy(bytes().subspan(offset, out.size()), out.begin());
        return;
    }
    try {
        if (descriptor_) {
            descriptor_->read(offset, out, name_, bytes().size());
            require_same(descriptor_->stamp());
        } else {
            require_same(stamp_of(name_)); // it may be gone, or be no file any more
            const Descriptor again(name_);
            again.read(offset, out, name_, bytes().size());
            require_same(again.stamp());
        }
    } catch (const Error &error) {
        throw SourceError(error.what());
    }
}

void FileBytes::require_same(const FileStamp &found) const {
    if (!same_content(stamp_, found)) {
        throw Error(name_ + ": was changed while it was played" + bake_again);
    }
}

std::span<const std::byte> FileBytes::bytes() const {
    return memory_ ? memory_->bytes() : std::span<const std::byte>();
}

} // namespace paradize::assets
