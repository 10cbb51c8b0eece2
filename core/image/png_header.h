/// Headers of PNG files, walked before libpng sees them: it allocates what a damaged file says, and learns
/// only then that the file ends. Part of the image module (image_module.h).
#pragma once

#include "image/image_module.h"

#include <string>

namespace crt::image {

/// Throws DamagedHeader (image_bounds.h) unless every chunk lies within the file, and its pixels may.
void checkPngHeader(const std::string& path);
/// The tags in the chunks of a PNG that checkPngHeader() has checked.
CrtUnappliedTags tagsOfPng(const std::string& path);

}  // namespace crt::image
