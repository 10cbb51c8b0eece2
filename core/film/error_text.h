/// What an image knows of its error, as text.
#pragma once

#include "film/error_estimate.h"

#include <string>

namespace crt {

/// "error 1.90 % (1.86-1.94)": relative root mean square error with its 95 % interval; "error below 9 %"
/// where only a bound is known; "error not yet known" where too few paths carry the light. ASCII, so that
/// bytes are columns.
std::string errorText(const ErrorEstimate& error);
/// "1200-3400": an interval of numbers of samples, two digits each.
std::string sampleCountText(const stats::Interval& samples);
}  // namespace crt
