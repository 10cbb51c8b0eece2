// crt_cxx: compiles one kernel for the Embree backend, which starts it (embree_lean_kernel.h). Not for
// people.
#include "embree_lean_kernel.h"

int main() { return crt::plugin::runCompileProcess("crt_cxx", crt::embree::compileJob); }
