/// Declarations of the measured tables in spectra_data.cpp and metals_data.cpp. Only spectra.cpp,
/// rgb_spectrum.cpp and data_catalogue.cpp read them.
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
extern const std::array<Glass, 26> kGlasses;

/// Complex refractive index n + ik at some wavelengths, ascending.
struct Metal {
    std::string_view symbol;
    std::string_view name;
    std::span<const double> wavelength_nm, n, k;
    std::string_view source;
};
extern const std::array<Metal, 21> kMetals;

}  // namespace crt::data
