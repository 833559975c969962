#include "assets/reserved_memory.hpp"

#include "error.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace paradize::assets {

namespace {

/// nullptr if there is no range so large.
std::byte *range_of(std::size_t size) {
    void *data =
        ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return data == MAP_FAILED ? nullptr : static_cast<std::byte *>(data);
}

} // namespace

ReservedMemory::ReservedMemory(std::size_t size) : data_(range_of(size)), size_(size) {
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
    std::vector<ReservedMemory> out;
    if (std::byte *data = sum == 0 ? nullptr : range_of(sum); data != nullptr) {
        out.reserve(sizes.size());
        for (const std::size_t size : sizes) {
            out.push_back(ReservedMemory(data, size));
            data += whole(size);
        }
    }
    return out;
}

ReservedMemory::ReservedMemory(ReservedMemory &&other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

ReservedMemory &ReservedMemory::operator=(ReservedMemory &&other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

ReservedMemory::~ReservedMemory() {
    if (data_ != nullptr) {
        ::munmap(data_, size_);
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
