/// Film → image.
#pragma once

#include "film/film.h"
#include "image/development.h"
#include "image/image.h"

#include <cstdint>

namespace crt {

/// XYZ sums → colour image, developed as said; AOVs as asked. StdError and Variance are of the luminance
/// that the image has. The metadata is what the film and the development know. Throws crt::Error(Usage) for
/// an AOV that the film lacks.
Image resolveImage(const Film& film, const Development& development, std::uint32_t aovs);

}  // namespace crt
