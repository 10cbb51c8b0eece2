/// Tabulated distributions that the kernels sample: wavelengths, pixel filters, the choice of an emitter.
#pragma once

#include "scene/scene.h"

#include <cstdint>
#include <vector>

namespace crt {

/// cells + 1 wavelengths in nm, 360 … 830, increasing: the inverse of a distribution whose density follows
/// (x̄ + ȳ + z̄)^0.4 (docs/decisions/0008-wavelengths.md). Half of it where `film` measures spectra; the
/// other half is uniform over what it measures (0025-spectral-film.md). Linear between
/// nodes, so each cell has the density 1/(cells·Δλ) exactly.
std::vector<float> wavelengthTable(std::size_t cells, const SpectralFilm& film = {});

/// `stride` times (x̄, ȳ, z̄, 0) / ∫ȳ dλ, at 360, 361, … nm; the last repeats 830 nm.
std::vector<float> observerTable(std::size_t stride);

/// Distances from the pixel centre, in pixels, that a share v of the film's filter along one axis is beyond:
/// for v = 1 first, then `steps` for each of `octaves` halvings of v, evenly in v from one halving to the
/// next; the last is that of half the least v, for all that is rarer. Empty for the box of radius ½, which
/// is uniform in the pixel.
std::vector<float> filterTable(const FilmSettings& film, std::size_t octaves, std::size_t steps);

/// Shares of 2^32 proportional to `weights` (≥ 0, one of them > 0), at least 1 each: item i is chosen by
/// the 32-bit numbers in [first[i], first[i+1]). Returns weights.size() + 1 boundaries, the last 2^32; {0}
/// for no items.
std::vector<std::uint64_t> choiceTable(const std::vector<double>& weights);

}  // namespace crt
