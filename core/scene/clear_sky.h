/// The clear sky of Hosek and Wilkie: its radiance, and that of its sun, by direction and wavelength.
/// Source: L. Hosek and A. Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance", ACM Transactions
/// on Graphics 31(4), 2012; "Adding a Solar-Radiance Function to the Hosek-Wilkie Skylight Model", IEEE
/// Computer Graphics and Applications 33(3), 2013.
#pragma once

#include "spectra/spectra.h"

#include <array>
#include <cstddef>
#include <vector>

namespace crt {

/// The wavelengths of the model: 360, 400, … 720 nm.
inline constexpr std::size_t kSkyWavelengths = 10;
inline constexpr int kSkyWavelengthStep_nm = 40;
/// A value at each.
using SkyValues = std::array<double, kSkyWavelengths>;

inline constexpr double kLeastTurbidity = 1, kMostTurbidity = 10;
inline constexpr double kUsualGroundAlbedo = 0.3;
/// Of the sun, as the model has it.
inline constexpr double kSkySunDiameter_deg = 0.5358;

/// A part of the sun's disk, around its middle.
struct SunDisk {
    double diameter;     ///< Over that of the sun.
    SkyValues radiance;  ///< W·m⁻²·sr⁻¹·nm⁻¹, on top of the wider disks'.
};

class ClearSkyModel {
public:
    /// For a turbidity of 1 to 10, a reflectance of the ground, and the sun's elevation, 0 to π/2. Reads
    /// data/sky/hosek_wilkie.txt, once. Throws crt::Error(Scene) where there is none, or it is broken.
    ClearSkyModel(double turbidity, const SkyValues& ground_albedo, double sun_elevation_rad);

    /// Spectral radiance of a direction, by the cosine of its angle with the zenith, its angle with the
    /// sun in radians, and the cosine of that; 0 below the horizon.
    SkyValues radiance(double cos_zenith, double to_sun_rad, double cos_to_sun) const;
    /// Irradiance of level ground by the sky alone, W·m⁻²·nm⁻¹.
    SkyValues horizontalIrradiance() const;
    /// The sun as `count` disks of equal steps in area that lie on each other: so it is darker towards its
    /// limb, and its irradiance is exact.
    std::vector<SunDisk> sunDisks(std::size_t count) const;

private:
    double elevation_;
    /// Of each wavelength: the nine parameters of the distribution, and the mean radiance.
    std::array<std::array<double, 10>, kSkyWavelengths> sky_;
    SkyValues sun_;                                            ///< Radiance of its middle.
    std::array<std::array<double, 6>, kSkyWavelengths> limb_;  ///< Of its darkening, constant first.
};

/// The values at the model's wavelengths, linear between; beyond 720 nm, where the model ends, the last.
Spectrum skySpectrum(const SkyValues& values);
/// The spectrum at the model's wavelengths.
SkyValues skyValues(const Spectrum& spectrum);

}  // namespace crt
