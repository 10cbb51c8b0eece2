// The tests of rays once more, where no eight triangles are taken at a time: as a GPU's lanes take them, by
// patches, with wide loads.
#include "unit_kernel_rays.cpp"
