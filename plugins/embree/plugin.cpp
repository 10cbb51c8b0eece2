// The Embree backend: its ABI table and its one device, the processor.
#include "embree_integrator.h"

#include "kernel/dialect/features.h"

CRT_DEFINE_BACKEND_BUILT_WITH(crt::embree::EmbreeIntegrator, crt::embree::probeDevices, "embree",
                              CRT_HEADERS_VERSION, CRT_COMPILER_TEXT, CRT_FEATURES_ALL)
