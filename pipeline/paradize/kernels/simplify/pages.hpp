// Large arrays on large pages where the system has them: memory is met in no order.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace paradize::simplify {

template <typename T>
struct Pages {
    using value_type = T;

    Pages() = default;
    template <typename U>
    explicit Pages(const Pages<U> &) {}

    T *allocate(std::size_t count) {
        constexpr std::size_t page = std::size_t{1} << 21;
        if (count > (static_cast<std::size_t>(-1) - page) / sizeof(T)) {
            throw std::bad_alloc();
        }
        const std::size_t bytes = count * sizeof(T);
        const std::size_t unit = bytes >= page ? page : std::size_t{128};
        const std::size_t whole = (bytes + unit - 1) / unit * unit + (bytes == 0 ? unit : 0);
        void *found = std::aligned_alloc(unit, whole);
        if (found == nullptr) {
            throw std::bad_alloc();
        }
#if defined(__linux__)
        if (unit == page) {
            madvise(found, whole, MADV_HUGEPAGE); // a wish: without it all is as right, only slower
        }
#endif
        return static_cast<T *>(found);
    }
    void deallocate(T *at, std::size_t) {
        std::free(at);
    }
    bool operator==(const Pages &) const = default;
};

template <typename T>
using Array = std::vector<T, Pages<T>>;

} // namespace paradize::simplify
