/// File formats of the images that crt writes.
#pragma once

namespace crt {

enum class OutputFormat { Exr, Png, Ppm, Pfm };

}  // namespace crt
