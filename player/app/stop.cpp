#include "app/stop.hpp"

#include <csignal>

namespace paradize {

namespace {

volatile std::sig_atomic_t noted = 0;

extern "C" void note(int signal) {
    if (noted != 0) {
        std::raise(signal); // its handler was reset: it ends the program when this function returns
    }
    noted = signal;
}

} // namespace

void note_stop_signals() {
    struct sigaction action {};
    action.sa_handler = note;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before {};
        ::sigaction(signal, nullptr, &before);
        if (before.sa_handler == SIG_DFL) { // else it is ignored, as in a shell's background job
            ::sigaction(signal, &action, nullptr);
        }
    }
}

int stop_signal() {
    return noted;
}

void end_by_stop_signal() {
    if (const int signal = noted; signal != 0) {
        std::raise(signal); // its handler was reset when it came
    }
}

} // namespace paradize
