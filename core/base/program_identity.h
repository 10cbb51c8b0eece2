/// Tells one build of crt from all others.
#pragma once

#include <string>

namespace crt {

/// The build ID of the file that holds this code (crt, libcrt.so, the Python module): the linker's hash of
/// all code and data in it, as bytes. Empty where the linker wrote none. [any thread]
std::string buildId();

}  // namespace crt
