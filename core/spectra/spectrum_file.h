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

/// A sentence for wavelengths from `first_nm` to `last_nm` that cannot be nanometres, with a guess of their
/// unit; empty for others. Such a table would be a constant, whatever its values.
std::string refusalOfUnit(double first_nm, double last_nm);

}  // namespace crt
