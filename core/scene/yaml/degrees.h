/// Sine and cosine of angles in degrees.
#pragma once

#include <cmath>
#include <numbers>

namespace crt {

/// Exact at multiples of 90°: a box turned by a quarter stays a box.
inline double sineOfDegrees(double degrees) {
    const double turn = std::remainder(degrees, 360.0);  // −180 to 180, exact.
    if (turn == 0 || std::abs(turn) == 180) return 0;
    if (std::abs(turn) == 90) return std::copysign(1.0, turn);
    return std::sin(turn * (std::numbers::pi / 180));
}

inline double cosineOfDegrees(double degrees) {
    return sineOfDegrees(90 - std::abs(std::remainder(degrees, 360.0)));
}

}  // namespace crt
