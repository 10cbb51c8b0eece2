/// Bins of wavelengths and responses of sensors, as the kernel adds to them.
#pragma once

#include "compile/blob_writer.h"
#include "scene/spectral_film.h"

#include <cstdint>

namespace crt {

/// `channels` is the number of all channels of the film, of which `film`'s are the last.
kernel::CrtSpan appendSpectralFilm(BlobWriter& blob, const SpectralFilm& film, std::uint32_t channels);

}  // namespace crt
