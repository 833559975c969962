#include "assets/thread_priority.hpp"

#ifdef __linux__
#include <algorithm>
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace paradize::assets {

void yield_to_drawing() {
#ifdef __linux__
    constexpr int nicer = 5; // a third of the share of a thread that draws, should a frame wait for it
    constexpr int nicest = 19;
    const auto thread = static_cast<id_t>(gettid()); // of Linux: each thread has a priority of its own
    setpriority(PRIO_PROCESS, thread, std::min(getpriority(PRIO_PROCESS, thread) + nicer, nicest));
#endif
}

} // namespace paradize::assets
