// Preloaded into the player by tests/player/streaming/test_slow_files.py. The first
// PARADIZE_SLOW_READS reads of the file named by PARADIZE_SLOW_FILE, but for its headers, take
// PARADIZE_SLOW_MS more, as from a slow disk.

#include <atomic>
#include <cstdlib>
#include <dlfcn.h>
#include <string>
#include <sys/types.h>
#include <unistd.h>

extern "C" ssize_t pread(int descriptor, void *out, std::size_t count, off_t at) {
    using Call = ssize_t (*)(int, void *, std::size_t, off_t);
    static const auto call = reinterpret_cast<Call>(::dlsym(RTLD_NEXT, "pread"));
    static const char *const file = std::getenv("PARADIZE_SLOW_FILE");
    static std::atomic<int> left = std::atoi(std::getenv("PARADIZE_SLOW_READS"));
    static const int ms = std::atoi(std::getenv("PARADIZE_SLOW_MS"));
    char path[4096];
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    const ssize_t length = ::readlink(link.c_str(), path, sizeof path - 1);
    if (count > 4096 && length > 0 && std::string(path, static_cast<std::size_t>(length)) == file &&
        left-- > 0) {
        ::usleep(static_cast<useconds_t>(1000 * ms));
    }
    return call(descriptor, out, count, at);
}
