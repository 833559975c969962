// The main() of each suite of C++ tests. All other files only include <doctest/doctest.h>.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <cstdlib>

int main(int argc, char **argv) {
    ::setenv("PARADIZE_CHECKED", "", 1); // tests leave no record with what a user's player has checked
    return doctest::Context(argc, argv).run();
}
