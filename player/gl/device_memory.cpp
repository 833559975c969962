#include "gl/device_memory.hpp"

#include "gl/debug.hpp"

#include <cstdlib> // defines __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace paradize::gl {

void keep_deleted_memory() {
#ifdef __GLIBC__
    if (software_renderer()) {
        constexpr int kept_bytes = 256 << 20;
        constexpr int largest_bytes = 32 << 20; // glibc's limit; larger ones are mapped and unmapped
        mallopt(M_TRIM_THRESHOLD, kept_bytes);
        mallopt(M_MMAP_THRESHOLD, largest_bytes);
    }
#endif
}

} // namespace paradize::gl
