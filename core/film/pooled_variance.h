/// Usable variances of single pixels. With one degree of freedom a pixel's own variance may be near 0 by
/// chance; its neighbours have similar noise.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace crt::stats {

/// Pixels on each side that are pooled: 7 × 7.
inline constexpr std::uint32_t kPooledRadius = 3;

/// Mean of `values` ([height][width]) over a square of 2·radius + 1 about each place, as much of it as lies
/// in the image.
std::vector<double> windowMeans(std::span<const double> values, std::uint32_t width, std::uint32_t height,
                                std::uint32_t radius);

/// Variances of the pixels of an image, [height][width].
struct PooledVariances {
    /// The larger of the pixel's own and of the mean about it; less the part by which the larger of two is
    /// too large, so that among equal pixels deviations over their standard errors have mean square 1.
    std::vector<double> variances;
    /// Degrees of freedom of the mean over the neighbourhood (Satterthwaite 1946), at least those of one
    /// pixel.
    std::vector<double> degrees_of_freedom;
};

/// From estimates with `dof` degrees of freedom each; infinite ones are not known, add nothing to their
/// neighbours' and stay infinite.
PooledVariances pooledVariances(std::span<const double> own, std::uint32_t width, std::uint32_t height,
                                double dof);

/// `variances` ([height][width], a separate variance of each pixel) with no 0 unless all are. Where all
/// samples of a pixel and of its neighbourhood have missed a light, 0 would say that all is known. Such a
/// pixel gets the mean over the smallest block that contains it and has a variance, of blocks of 8, 16,
/// 32, … pixels a side.
std::vector<double> variancesWithoutZeros(std::vector<double> variances, std::uint32_t width,
                                          std::uint32_t height);

}  // namespace crt::stats
