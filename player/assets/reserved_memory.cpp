#include "assets/reserved_memory.hpp"

#include "error.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace paradize::assets {

class ReservedMemory::Range {
  public:
    /// Without data if the system has no range so large.
    explicit Range(std::size_t size)
        : data_(::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1,
                       0)),
          size_(size) {}
    ~Range() {
        if (data_ != MAP_FAILED) {
            ::munmap(data_, size_);
        }
    }
    Range(const Range &) = delete;
    Range &operator=(const Range &) = delete;
    std::byte *data() const { return data_ == MAP_FAILED ? nullptr : static_cast<std::byte *>(data_); }

  private:
    void *data_;
    std::size_t size_;
};

ReservedMemory::ReservedMemory(std::shared_ptr<const Range> range, std::byte *data, std::size_t size)
    : range_(std::move(range)), data_(data), size_(size) {}

ReservedMemory::ReservedMemory(std::size_t size) : range_(std::make_shared<const Range>(size)), size_(size) {
    data_ = range_->data();
    if (data_ == nullptr) {
        throw Error("no memory for " + std::to_string(size) + " bytes: " + std::strerror(errno));
    }
}

std::vector<ReservedMemory> ReservedMemory::side_by_side(std::span<const std::size_t> sizes) {
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const auto whole = [&](std::size_t size) { return (size + page - 1) / page * page; };
    std::size_t sum = 0;
    for (const std::size_t size : sizes) {
        sum += whole(size);
    }
    const auto range = std::make_shared<const Range>(sum); // none of 0 bytes
    std::vector<ReservedMemory> out;
    if (std::byte *data = range->data(); data != nullptr) {
        out.reserve(sizes.size());
        for (const std::size_t size : sizes) {
            out.push_back(ReservedMemory(range, data, size));
            data += whole(size);
        }
    }
    return out;
}

ReservedMemory &ReservedMemory::operator=(ReservedMemory &&other) noexcept {
    std::swap(range_, other.range_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

ReservedMemory::~ReservedMemory() {
    if (range_) {
        release();
    }
}

void ReservedMemory::populate([[maybe_unused]] std::span<std::byte> part) const {
#ifdef MADV_POPULATE_WRITE
    ::madvise(part.data(), part.size(), MADV_POPULATE_WRITE);
#endif
}

void ReservedMemory::release() const {
    ::madvise(data_, size_, MADV_DONTNEED);
}

} // namespace paradize::assets
