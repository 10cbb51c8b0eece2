// crt_nvrtc: compiles one kernel for the CUDA backend, which starts it (cuda_compile_process.h). Not for
// people.
#include "cuda_compile_process.h"

#include <unistd.h>

int main() {
    // _exit: what NVRTC leaves to destructors of static objects is given back with the process.
    ::_exit(crt::plugin::runCompileProcess("crt_nvrtc", crt::cuda::compileJob));
}
