/// Film → image.
#pragma once

#include "film/film.h"
#include "image/development.h"
#include "image/image.h"

#include <cstdint>

namespace crt {

/// XYZ sums → colour image, developed as requested, with the requested AOVs. StdError, Variance and
/// HalfWidth95 describe the luminance of the image and are pooled (pooled_variance.h). HalfWidth95 comes
/// with StdError, and OwnVariance with either of them. The metadata holds what the film and the development
/// know. Throws crt::Error(Usage) for an AOV that the film lacks.
Image resolveImage(const Film& film, const Development& development, std::uint32_t aovs,
                   const SpectralChannels& spectral = {});

}  // namespace crt
