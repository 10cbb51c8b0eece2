/// Film → image.
#pragma once

#include "film/film.h"
#include "image/development.h"
#include "image/image.h"

#include <cstdint>

namespace crt {

/// XYZ sums → colour image, developed as said; AOVs as asked. StdError, Variance and
/// HalfWidth95 are of the
/// luminance that the image has, pooled (pooled_variance.h); HalfWidth95 comes with StdError, OwnVariance
/// with any of them. The metadata is what the film and the development know. Throws crt::Error(Usage) for an
/// AOV that the film lacks.
///
/// `spectral` names the film's spectral channels, which follow in the layout of Fichet et al.
/// (2021): "S0.550,000000nm" is the mean radiance of the bin around 550 nm, "Response.NAME" the signal
/// of a sensor. No development changes them.
Image resolveImage(const Film& film, const Development& development, std::uint32_t aovs,
                   const SpectralChannels& spectral = {});

}  // namespace crt
