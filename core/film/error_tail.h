/// Estimates from the noisiest pixels of an image whether paths brighter than all samples so far are likely.
///
/// Where one path carries a pixel, the pixel's standard error is as large as what the path adds to the
/// pixel, whatever the number of replicates or samples. The variances of such pixels are then squares of
/// single paths' luminances, and their tail is that of the paths. A variance falls off as v^-α beyond v.
/// With α below 1 the sum of all variances has no mean: its largest term makes it up, and every brighter
/// path that is met later makes the earlier estimates too small (a point light in a glossy surface, seen by
/// scattered light: α = 1/4 up to the peak of the surface's lobe).
#pragma once

#include "film/film.h"

#include <cstdint>
#include <span>

namespace crt {

struct NoisyPixel {
    std::uint32_t x, y;
    double variance;  ///< Of the mean of Y.
};

struct ErrorTail {
    /// α by Hill (1975, Annals of Statistics 3), of the ten noisiest pixels that one path carries; infinite
    /// where there are fewer than two.
    double index;
    double share;  ///< Share of these pixels in the sum of all variances.
};

/// Looks at the 256 noisiest of `pixels` at most, and reorders them.
ErrorTail errorTail(const Film& film, std::span<NoisyPixel> pixels);

/// True if paths that no sample has met yet may make the error larger than an estimate with
/// `degrees_of_freedom` from `paths` paths.
bool tailIsOpen(const ErrorTail& tail, double degrees_of_freedom, double paths);

}  // namespace crt
