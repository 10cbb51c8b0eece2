/// The folders in which drivers keep compiled kernels.
#pragma once

namespace crt::opencl {

/// Gives PoCL a private cache folder for the life of the process if another user can write to its default
/// one, because PoCL executes the kernels that it finds there: $XDG_CACHE_HOME, ~/.cache, or /tmp/pocl
/// without HOME (cron, systemd, containers). Leaves POCL_CACHE_DIR as the user set it. Call it before any
/// OpenCL function. [any thread]
void keepKernelsFromOthers();

}  // namespace crt::opencl
