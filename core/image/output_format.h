/// File formats of the images that crt writes.
#pragma once

namespace crt {

enum class OutputFormat { Exr, Png, Jpeg, Ppm, Pfm };

/// The ends of their names, for messages.
inline constexpr const char* kImageEnds = ".exr, .png, .jpg, .ppm or .pfm";

}  // namespace crt
