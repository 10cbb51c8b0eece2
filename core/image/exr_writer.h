/// Writes EXR files through OpenEXR. Part of the image module (image_module.h).
#pragma once

#include "image/image_module.h"

namespace crt::image {

/// Every float channel as float, every integer channel as uint32, zip compressed. Throws std::exception with
/// a sentence to follow the name of the file.
void writeExr(const char* path, const CrtImagePlanes& image);

}  // namespace crt::image
