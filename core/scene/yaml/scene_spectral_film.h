/// The spectral data of a film: film.spectral and film.responses.
#pragma once

#include "scene/spectral_film.h"
#include "scene/yaml/scene_spectra.h"

namespace crt {

/// `film` is the section of that name.
SpectralFilm readSpectralFilm(const SectionReader& film, SpectrumReader& spectra);

}  // namespace crt
