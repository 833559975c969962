#include "assets/reserved_memory.hpp"

#include "error.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <sys/mman.h>
#include <utility>

namespace paradize::assets {

ReservedMemory::ReservedMemory(std::size_t size) : size_(size) {
    void *data =
        ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (data == MAP_FAILED) {
        throw Error("no memory for " + std::to_string(size) + " bytes: " + std::strerror(errno));
    }
    data_ = static_cast<std::byte *>(data);
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
