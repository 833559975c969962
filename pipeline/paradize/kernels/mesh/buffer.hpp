// Large arrays that a kernel fills itself: not zeroed first, on large pages where the system has them.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace paradize::mesh {

template <typename T>
class Buffer {
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    explicit Buffer(std::size_t size) : size_(size) {
        constexpr std::size_t page = std::size_t{1} << 21;
        const std::size_t bytes = size * sizeof(T);
        const std::size_t unit = bytes >= page ? page : std::size_t{64};
        if (size > (static_cast<std::size_t>(-1) - page) / sizeof(T))
            throw std::bad_alloc();
        const std::size_t whole = (bytes + unit - 1) / unit * unit + (bytes == 0 ? unit : 0);
        data_.reset(static_cast<T *>(std::aligned_alloc(unit, whole)));
        if (!data_)
            throw std::bad_alloc();
#if defined(__linux__)
        if (unit == page)
            madvise(data_.get(), whole, MADV_HUGEPAGE); // a wish: without it all is as right, only slower
#endif
    }
    T &operator[](std::size_t i) {
        return data_.get()[i];
    }
    const T &operator[](std::size_t i) const {
        return data_.get()[i];
    }
    T *data() {
        return data_.get();
    }
    const T *data() const {
        return data_.get();
    }
    std::size_t size() const {
        return size_;
    }

  private:
    struct Free {
        void operator()(T *p) const { std::free(p); }
    };
    std::size_t size_;
    std::unique_ptr<T, Free> data_;
};

} // namespace paradize::mesh
