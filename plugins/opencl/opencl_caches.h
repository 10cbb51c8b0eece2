/// Where drivers keep compiled kernels.
#pragma once

namespace crt::opencl {

/// PoCL runs the compiled kernels that it finds in a folder: in $POCL_CACHE_DIR, $XDG_CACHE_HOME or
/// ~/.cache, and without HOME (cron, systemd, containers) in /tmp/pocl, whoever made that. If another user
/// can write there, PoCL gets a folder of its own for as long as this process lives. POCL_CACHE_DIR is the
/// user's word and stays. To be called before anything of OpenCL is. [any thread]
void keepKernelsFromOthers();

}  // namespace crt::opencl
