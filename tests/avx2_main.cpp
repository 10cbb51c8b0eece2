// The main of tests compiled for AVX2. Compiled without it: on a CPU that lacks it nothing else of the
// program may run, static initialisers included.
#include "catch_runner.h"

#if defined(__x86_64__)
#include <unistd.h>

#include <cstdio>

namespace {

constexpr int kSkipped = 77;

__attribute__((constructor(101))) void leaveWithoutAvx2() {
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return;
    std::puts("skipped: this CPU has no AVX2 with FMA");
    std::fflush(stdout);
    ::_exit(kSkipped);
}

}  // namespace
#endif

int main(int argc, char** argv) {
    return runTests(argc, argv);
}
