/// Files of two columns, wavelength and value, before they are resampled.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// Wavelengths strictly increasing, both columns of one length, everything finite.
struct SpectrumColumns {
    std::vector<double> wavelength_nm;
    std::vector<double> value;
};

/// What readSpectrumFile() (spectra.h) reads. Throws crt::Error(Scene) with file and line.
SpectrumColumns readSpectrumColumns(const std::string& path);

}  // namespace crt
