/// Reflectances of three numbers. W. Jakob and J. Hanika, "A Low-Dimensional Function Space for Efficient
/// Spectral Upsampling", Computer Graphics Forum 38(2), 2019: the sigmoid ½ + x / (2√(1 + x²)) of
/// x = c₀ + c₁t + c₂t², t the wavelength as −1 (360 nm) to 1 (830 nm), is smooth and cannot leave
/// (0, 1). The kernel evaluates it (crt_sigmoid in kernel/sampling/spectrum.h).
#pragma once

#include "spectra/spectra.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

using SigmoidCoefficients = std::array<float, 3>;

/// Coefficients of a linear sRGB colour in [0, 1]. The colour that the reflectance shows under D65 is within
/// 10⁻⁴ of it in each component on average, and 3·10⁻³ at worst, next to white
/// (tests/unit_sigmoid.cpp); greys are exact. Black and white are 10⁻⁷ off 0 and 1. Values outside [0,
/// 1] count as the nearer end; NaN as 0. The first call reads a table of 2.7 MB (base/table_store.h) or
/// makes it, by threads, in a fraction of a second. [any thread]
SigmoidCoefficients sigmoidCoefficients(const std::array<float, 3>& linear_srgb);

/// The table behind sigmoidCoefficients(), for callers with millions of colours.
class SigmoidTable {
public:
    /// Reads the values, or makes them.
    SigmoidTable();
    /// One for the process; the first call constructs it.
    static const SigmoidTable& get();

    /// The part that depends only on the largest component of a colour; images have few of them.
    struct Level {
        float value, inverse, position;
    };
    static Level level(float largest);
    /// `linear_srgb` as above; `level` is that of its largest component, which is the `channel`-th.
    SigmoidCoefficients coefficients(const std::array<float, 3>& linear_srgb, std::size_t channel,
                                     const Level& level) const;

private:
    void make();
    struct Node {
        float c[4];
    };
    static std::size_t index(std::size_t channel, std::size_t level, std::size_t a, std::size_t b);
    std::vector<Node> nodes_;
};

// ---- Fits, by which tables and spectra are made
// -----------------------------------------------------------

/// A wavelength as t, and how much a reflectance there adds to linear sRGB under D65.
struct SigmoidNode {
    double t;
    Vec3d weight;
};

/// t of a wavelength that is this number of nanometres above 360.
double sigmoidWavelength(double nanometres);

/// Contribution of each wavelength of a reflectance under D65 to linear sRGB. Each channel sums to exactly
/// what white gives, 1, also where the tabulated D65 and the rounded white point of sRGB differ in the
/// fourth digit; so greys are constants and colours close to grey are close to constants.
const std::array<Spectrum, 3>& rgbWeights();

/// Improves `c` until the colour of `nodes` is `rgb` to within `accuracy`, or as near as it gets.
void fitSigmoid(Vec3d& c, const Vec3d& rgb, std::span<const SigmoidNode> nodes, double accuracy);
/// From nothing.
Vec3d fittedSigmoid(const Vec3d& rgb, std::span<const SigmoidNode> nodes, double accuracy);
/// The same to the last digit, on every nanometre.
Vec3d fittedSigmoid(const Vec3d& rgb);

/// The reflectance on the 1 nm grid.
Spectrum sigmoidSpectrum(const Vec3d& c);

/// The reflectance at t.
double sigmoidAt(const Vec3d& c, double t);

/// A value in (0, 1) that a sigmoid is to have at t.
struct SigmoidTarget {
    double t, value, weight;
    Vec3d colour;  ///< Of a value of 1: its part of a colour that is to be kept, about 1.
};

/// The sigmoid for which Σ weight · off² + |Σ colour · off|² is least, where off is its value less the
/// target's, by a few steps of Gauss and Newton.
Vec3d nearestSigmoid(std::span<const SigmoidTarget> targets);

}  // namespace crt
