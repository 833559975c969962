// Parses the arguments, runs the player and returns the exit code. Exceptions end here as messages.

#include "app/messages.hpp"
#include "app/options.hpp"
#include "app/run.hpp"
#include "app/stop.hpp"
#include "error.hpp"
#include "passes/pass.hpp"

#include <exception>
#include <string>

int main(int argc, char **argv) {
    try {
        const paradize::Options options =
            paradize::parse_options({argv + 1, argv + (argc > 0 ? argc : 1)}, paradize::pass_names());
        if (!options.help.empty()) {
            paradize::print(options.help);
            return 0;
        }
        paradize::note_stop_signals();
        const int code = paradize::run(options);
        paradize::end_by_stop_signal();
        return code;
    } catch (const paradize::UsageError &error) {
        paradize::log_message(std::string(error.what()) + "\n`paradize-player --help` lists the options");
        return 2;
    } catch (const std::exception &error) {
        paradize::log_message(error.what());
        return 1;
    }
}
