#include "assets/mapped_file.hpp"

#include "error.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace paradize::assets {

MappedFile::MappedFile(const std::filesystem::path &path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) {
        throw Error(path.string() + ": " + std::strerror(errno));
    }
    struct stat status {};
    std::string problem;
    void *data = MAP_FAILED;
    if (::fstat(descriptor, &status) != 0) {
        problem = std::strerror(errno);
    } else if (!S_ISREG(status.st_mode)) {
        problem = "is no regular file; bake the scene again";
    } else if (status.st_size <= 0) {
        problem = "is empty; bake the scene again";
    } else {
        data =
            ::mmap(nullptr, static_cast<std::size_t>(status.st_size), PROT_READ, MAP_PRIVATE, descriptor, 0);
        problem = data == MAP_FAILED ? std::string("cannot be mapped: ") + std::strerror(errno) : "";
    }
    ::close(descriptor);
    if (data == MAP_FAILED) {
        throw Error(path.string() + ": " + problem);
    }
    data_ = static_cast<const std::byte *>(data);
    size_ = static_cast<std::size_t>(status.st_size);
}

MappedFile::MappedFile(MappedFile &&other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

MappedFile &MappedFile::operator=(MappedFile &&other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

MappedFile::~MappedFile() {
    if (data_ != nullptr) {
        ::munmap(const_cast<std::byte *>(data_), size_);
    }
}

void MappedFile::release_pages() const {
    if (data_ != nullptr) {
        ::madvise(const_cast<std::byte *>(data_), size_, MADV_DONTNEED);
    }
}

} // namespace paradize::assets
