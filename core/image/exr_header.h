/// Headers of EXR files, walked before OpenEXR sees them: it allocates what a damaged file says, up to
/// gigabytes for each attribute, and learns only then that the file ends. Part of the image module
/// (image_module.h).
#pragma once

#include <string>

namespace crt::image {

/// Throws DamagedHeader (image_bounds.h) unless attributes have the sizes that their types say and lie
/// within the file, and its pixels may.
void checkExrHeader(const std::string& path);

}  // namespace crt::image
