/// Properties of a film's paths that its sums do not contain. Error estimates need them.
#pragma once

#include <limits>

namespace crt {

struct BrightestPath {
    /// Approximate luminance Y that one path can add to the film. Infinite if it is not known.
    double luminance = std::numeric_limits<double>::infinity();
    /// True if only paths of a narrow range of directions are as bright, because surfaces mirror a small
    /// light or scatter it into a narrow lobe. An image with few samples may contain none of them.
    bool rare = false;

    bool operator==(const BrightestPath&) const = default;
};

/// Rule of three: of what has not been met, no more than this is expected, with 95 % (Hanley and
/// Lippman-Hand 1983, JAMA 249).
inline constexpr double kUnmet = 3;

struct PathFacts {
    bool independent = false;  ///< Samples are not of a Sobol sequence: their spread is no mere bound.
    BrightestPath brightest{};
};

}  // namespace crt
