/// The folder of what crt keeps on disk between runs: compiled kernels and tables of materials.
#pragma once

#include <string>

namespace crt {

/// $CRT_CACHE_DIR, else `crt` in $XDG_CACHE_HOME or in ~/.cache; made if need be, for this user alone. Empty
/// where there is none that this process can use; the log says why. [any thread]
std::string cacheFolder();

}  // namespace crt
