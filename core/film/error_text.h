/// The error estimate of an image, as text.
#pragma once

#include "film/error_estimate.h"

#include <string>

namespace crt {

/// "error 1.90 % (1.86-1.94)": the expected root mean square error with its 95 % interval; "error below 9 %"
/// where only a bound is known; "error not yet known" where too few paths carry the light. ASCII, so that
/// bytes are columns. "... + missing light" where the image lacks light that no error contains
/// (scene/missing_light.h).
std::string expectedErrorText(const ErrorEstimate& error, bool light_is_missing = false);
/// "error 1.90 % (1.86-1.94) expected; this image: at most 1.95 %": also the 95 % half-width, where it is
/// known.
std::string errorText(const ErrorEstimate& error, bool light_is_missing = false);
/// "1200-3400": an interval of numbers of samples, two digits each.
std::string sampleCountText(const stats::Interval& samples);
}  // namespace crt
