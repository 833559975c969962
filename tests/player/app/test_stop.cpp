#include "app/stop.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

using namespace paradize;

namespace {

// ThreadSanitizer calls no handler in the child of a process that had threads when it forked.
#ifdef __SANITIZE_THREAD__
constexpr bool calls_no_handler = true;
#else
constexpr bool calls_no_handler = false;
#endif

} // namespace

TEST_CASE("stop: the first signal is noted, a second one of another kind ends the program at once" *
          doctest::skip(calls_no_handler)) {
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        std::signal(SIGINT, SIG_DFL); // doctest has handlers of its own
        std::signal(SIGTERM, SIG_DFL);
        note_stop_signals();
        std::raise(SIGINT);
        if (stop_signal() == SIGINT) {
            std::raise(SIGTERM);
        }
        ::_exit(1);
    }
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WIFSIGNALED(status));
    CHECK(WTERMSIG(status) == SIGTERM);
}
