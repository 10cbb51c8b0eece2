// The kernel compiled ahead of time, once per feature mask: CMakeLists.txt builds this file with
// CRT_FEATURES and CRT_EMBREE_ENTRY set for each row of embree_program.cpp's table.
#include "embree_kernels.h"

#include "kernels.h"
