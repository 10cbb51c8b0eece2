// The one main of the unit tests; in a file of its own because compiling Catch's runner takes longer than any test.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
