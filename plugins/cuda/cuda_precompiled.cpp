// The fat binary that nvcc made, taken into the library as it is. CRT_FATBIN is its path, given by
// CMakeLists.txt.
#include "cuda_precompiled.h"

__asm__(
    ".pushsection .rodata\n"
    ".balign 64\n"
    ".global kPrecompiledKernels\n"
    ".hidden kPrecompiledKernels\n"
    ".type kPrecompiledKernels, @object\n"
    "kPrecompiledKernels:\n"
    ".incbin \"" CRT_FATBIN "\"\n"
    ".size kPrecompiledKernels, . - kPrecompiledKernels\n"
    ".popsection\n");
