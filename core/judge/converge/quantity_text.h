/// Numbers for people: few digits, units always, and the interval beside the value. Plain UTF-8.
#pragma once

#include "judge/converge/measurement.h"

#include <cstdint>
#include <string>

namespace crt::converge {

/// `digits` significant ones, without exponent between 10⁻⁴ and 10⁶: "0.0123", "412", "1.2·10⁷".
/// Not a number: "–".
std::string numberText(double value, int digits = 3);
/// "1.23 %"; of 0.0123.
std::string percentText(double value, int digits = 3);
/// "12 ms", "3.41 s", "4.2 min", "3.1 h"
std::string secondsText(double seconds, int digits = 3);

/// "2.41 s (2.35–2.47)": the interval in the value's unit. Without bounds, "2.41 s (no interval)".
std::string secondsText(const Estimate& estimate, int digits = 3);
std::string percentText(const Estimate& estimate, int digits = 3);
std::string numberText(const Estimate& estimate, int digits = 3);

/// An error: as percentText, but "below 0.31 %" where the interval reaches 0 because the reference's own
/// noise hides it.
std::string errorText(const Estimate& relative_rmse, int digits = 3);

}  // namespace crt::converge
