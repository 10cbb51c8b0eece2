/// An exposure for pictures of which the scene does not say one.
#pragma once

#include "film/film.h"

#include <optional>

namespace crt {

/// Stops that bring the geometric mean of the pixels' luminance to 18 % grey, in hundredths: the log-average
/// of Reinhard, Stark, Shirley and Ferwerda (2002), Photographic tone reproduction for digital images,
/// equations 1 and 2 with their key of 0.18. Pixels darker than a thousandth of the mean do not count: an
/// object before a black background would be too bright. The same film always gives the same number.
/// Nothing for a black film.
std::optional<double> autoExposure_ev(const Film& film);

}  // namespace crt
