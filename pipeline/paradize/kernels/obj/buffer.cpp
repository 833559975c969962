#include "obj/buffer.hpp"

#include <algorithm>
#include <cstdlib>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace paradize::obj {
namespace {

constexpr std::size_t huge_page = std::size_t{2} << 20;

#if defined(__linux__)
bool is_mapped(std::size_t held) {
    return held >= huge_page;
}

// Address space of `bytes` (whole huge pages) that starts at a huge page.
char *map_aligned(std::size_t bytes) {
    void *const got = mmap(nullptr, bytes + huge_page, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (got == MAP_FAILED)
        throw std::bad_alloc();
    char *const raw = static_cast<char *>(got);
    const std::size_t before = (huge_page - reinterpret_cast<std::uintptr_t>(raw) % huge_page) % huge_page;
    if (before)
        munmap(raw, before);
    munmap(raw + before + bytes, huge_page - before);
    madvise(raw + before, bytes, MADV_HUGEPAGE); // where it is refused, small pages do
    return raw + before;
}
#endif

} // namespace

void *grow_bytes(void *old, std::size_t used, std::size_t wanted, std::size_t &held) {
#if defined(__linux__)
    if (is_mapped(wanted)) {
        const std::size_t bytes = (wanted + huge_page - 1) / huge_page * huge_page;
        char *fresh = map_aligned(bytes);
        if (is_mapped(held)) {
            // Pages move, bytes do not.
            if (mremap(old, held, held, MREMAP_MAYMOVE | MREMAP_FIXED, fresh) == MAP_FAILED) {
                munmap(fresh, bytes);
                throw std::bad_alloc();
            }
        } else {
            if (used)
                std::memcpy(fresh, old, used);
            std::free(old);
        }
        held = bytes;
        return fresh;
    }
#endif
    (void)used;
    const std::size_t bytes = std::max<std::size_t>(wanted, 256);
    void *const fresh = std::realloc(old, bytes);
    if (!fresh)
        throw std::bad_alloc();
    held = bytes;
    return fresh;
}

void free_bytes(void *bytes, std::size_t held) noexcept {
#if defined(__linux__)
    if (is_mapped(held)) {
        munmap(bytes, held);
        return;
    }
#endif
    (void)held;
    std::free(bytes);
}

} // namespace paradize::obj
