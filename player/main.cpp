// Arguments in, exit code out; the only catch.

#include "error.hpp"
#include "options.hpp"
#include "passes/pass.hpp"
#include "report.hpp"
#include "show.hpp"

#include <cstdio>
#include <exception>

int main(int argc, char **argv) {
    try {
        const paradize::Options options =
            paradize::parse_options({argv + 1, argv + (argc > 0 ? argc : 1)}, paradize::pass_names());
        if (options.help) {
            paradize::print(paradize::usage(paradize::pass_names()));
            return 0;
        }
        return paradize::run(options);
    } catch (const paradize::UsageError &error) {
        std::fprintf(stderr, "paradize-player: %s\n`paradize-player --help` lists the options\n",
                     paradize::printable(error.what()).c_str());
        return 2;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "paradize-player: %s\n", paradize::printable(error.what()).c_str());
        return 1;
    }
}
