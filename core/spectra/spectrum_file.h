/// Files of two columns, wavelength and value, before they are resampled.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// Wavelengths strictly increasing, both columns of one length, everything finite.
struct SampledSpectrum {
    std::vector<double> wavelength_nm;
    std::vector<double> value;
};

/// The result of readSpectrumFile() (spectra.h). Throws crt::Error(Scene) with file and line.
SampledSpectrum readSpectrumTable(const std::string& path);

}  // namespace crt
