/// Declarations of the measured tables in spectra_data.cpp. Only spectra.cpp, rgb_spectrum.cpp and
/// data_catalogue.cpp read them.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace crt::data {

inline constexpr int kObserverSize = 471;  ///< 360-830 nm, one value a nanometre.

extern const std::array<double, kObserverSize> kCieX;
extern const std::array<double, kObserverSize> kCieY;
extern const std::array<double, kObserverSize> kCieZ;

/// Relative spectral power on an even grid. Power outside the table is unknown and taken as none.
struct Illuminant {
    std::string_view name;
    double first_nm;
    double step_nm;
    std::span<const double> power;
};
extern const std::string_view kIlluminantSource;
extern const std::array<Illuminant, 6> kIlluminants;

/// Sellmeier coefficients, L in micrometres, C in square micrometres.
struct Glass {
    std::string_view name;
    std::array<double, 3> B;
    std::array<double, 3> C_um2;
    std::string_view source;
};
extern const std::array<Glass, 7> kGlasses;

inline constexpr int kMetalSize = 56;
inline constexpr double kMetalFirst_eV =
    4.15;  ///< Photon energy of the first sample; the rest follow downwards.
inline constexpr double kMetalStep_eV = 0.05;

/// Wavelength of the sample `i` of a metal.
constexpr double metalWavelength_nm(std::size_t i) {
    constexpr double kElectronVoltNanometre = 1239.841984;  // h c / e, CODATA 2018.
    return kElectronVoltNanometre / (kMetalFirst_eV - kMetalStep_eV * static_cast<double>(i));
}

/// Complex refractive index n + ik at kMetalFirst_eV, kMetalFirst_eV − kMetalStep_eV, …
struct Metal {
    std::string_view symbol;
    std::string_view name;
    std::span<const double, kMetalSize> n;
    std::span<const double, kMetalSize> k;
};
extern const std::string_view kMetalSource;
extern const std::array<Metal, 4> kMetals;

}  // namespace crt::data
