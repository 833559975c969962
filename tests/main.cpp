// The main() of each suite of C++ tests. All other files only include <doctest/doctest.h>, as the header that
// is parsed once has already: that is why both words are needed here.
#define DOCTEST_CONFIG_IMPLEMENT
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
