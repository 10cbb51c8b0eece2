// crt_nvrtc: compiles one kernel for the CUDA backend, which starts it (cuda_compile_process.h). Not for
// people.
#include "cuda_compile_process.h"

#include <unistd.h>

#include <cstdio>

int main() {
    if (::isatty(STDIN_FILENO) != 0 || ::isatty(STDOUT_FILENO) != 0) {
        std::fputs(
            "crt_nvrtc compiles kernels for crt's CUDA backend, which starts it when needed; do not run it "
            "by hand\n",
            stderr);
        return 2;
    }
    // _exit: what NVRTC leaves to destructors of static objects is given back with the process.
    ::_exit(crt::cuda::runCompileProcess(STDIN_FILENO, STDOUT_FILENO));
}
