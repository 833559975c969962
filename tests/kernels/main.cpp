// The tests' main: every test_*.cpp beside it includes <doctest/doctest.h> only.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
