// The tests' main: every other file beside it includes <doctest/doctest.h> only.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
