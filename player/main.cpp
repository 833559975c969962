// Parses the arguments, runs the player and returns the exit code. Exceptions end here as messages.

#include "app/messages.hpp"
#include "app/options.hpp"
#include "app/report.hpp"
#include "app/run.hpp"
#include "app/stop.hpp"
#include "error.hpp"
#include "passes/pass.hpp"

#include <algorithm>
#include <csignal>
#include <exception>
#include <new>
#include <span>
#include <string>
#include <string_view>

namespace {

/// Reports an error, with --json on standard output too. Returns the exit code.
int failed(int code, const std::string &message, std::span<const char *const> arguments,
           const std::string &hint = "") {
    paradize::log_message(message + hint);
    if (std::ranges::find(arguments, std::string_view("--json")) != arguments.end()) {
        try {
            paradize::print(paradize::error_json(message) + "\n");
        } catch (const std::exception &error) {
            paradize::log_message(error.what());
        }
    }
    return code;
}

} // namespace

int main(int argc, char **argv) {
    const std::span<const char *const> arguments(argv + 1, argv + (argc > 0 ? argc : 1));
    try {
        const paradize::Options options = paradize::parse_options(arguments, paradize::pass_names());
        if (!options.help.empty()) {
            paradize::print(options.help);
            return 0;
        }
        std::signal(SIGXFSZ, SIG_IGN); // writing beyond `ulimit -f` fails, and the message says so
        paradize::note_stop_signals();
        const int code = paradize::run(options);
        paradize::end_by_stop_signal();
        return code;
    } catch (const paradize::UsageError &error) {
        return failed(2, error.what(), arguments, "\n`paradize-player --help` lists the options");
    } catch (const std::bad_alloc &) {
        return failed(1, "the machine has too little memory for this; free some, or draw a smaller --size",
                      arguments);
    } catch (const std::exception &error) {
        return failed(1, error.what(), arguments);
    }
}
