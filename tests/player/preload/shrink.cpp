// Preloaded into the player by tests/player/assets/test_files.py. Truncates a file to half its length
// while it is read: after it was opened ("open"), after its size was read ("stat"), after its first bytes
// were read ("read"), or when it is closed after its last byte was read ("close").

#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

bool done = false;
bool ended = false; // the last byte of the chosen file was read

template <typename Call>
Call real(const char *name) {
    return reinterpret_cast<Call>(::dlsym(RTLD_NEXT, name));
}

/// Truncates the file behind the descriptor, if it is the chosen file and moment.
void moment(const char *now, int descriptor) {
    const char *file = std::getenv("PARADIZE_SHRINK_FILE");
    const char *when = std::getenv("PARADIZE_SHRINK_AT");
    if (done || file == nullptr || when == nullptr || std::strcmp(now, when) != 0) {
        return;
    }
    char path[4096];
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    const ssize_t length = ::readlink(link.c_str(), path, sizeof path - 1);
    if (length > 0 && std::string(path, static_cast<std::size_t>(length)) == file) {
        done = true;
        struct stat status {};
        if (::stat(file, &status) != 0 || ::truncate(file, status.st_size / 2) != 0) {
            std::abort();
        }
    }
}

} // namespace

extern "C" {

int open(const char *path, int flags, ...) {
    mode_t mode = 0;
    if ((flags & O_CREAT) != 0) {
        va_list more;
        va_start(more, flags);
        mode = va_arg(more, mode_t);
        va_end(more);
    }
    static const auto call = real<int (*)(const char *, int, mode_t)>("open");
    const int descriptor = call(path, flags, mode);
    if (descriptor >= 0) {
        moment("open", descriptor);
    }
    return descriptor;
}

int fstat(int descriptor, struct stat *status) {
    static const auto call = real<int (*)(int, struct stat *)>("fstat");
    const int result = call(descriptor, status);
    moment("stat", descriptor);
    return result;
}

ssize_t pread(int descriptor, void *out, std::size_t count, off_t at) {
    static const auto call = real<ssize_t (*)(int, void *, std::size_t, off_t)>("pread");
    const ssize_t result = call(descriptor, out, count, at);
    struct stat status {};
    const char *file = std::getenv("PARADIZE_SHRINK_FILE");
    if (result > 0 && file != nullptr && ::stat(file, &status) == 0 && at + result == status.st_size) {
        ended = true;
    }
    moment("read", descriptor);
    return result;
}

int close(int descriptor) {
    if (ended) {
        moment("close", descriptor);
    }
    static const auto call = real<int (*)(int)>("close");
    return call(descriptor);
}

} // extern "C"
