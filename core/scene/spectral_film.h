/// The spectral data of a film besides X, Y and Z: bins of wavelengths, as a spectroradiometer has, and the
/// responses of sensors.
#pragma once

#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace crt {

inline constexpr std::uint32_t kMostSpectralBins = 1024;
inline constexpr std::uint32_t kMostSensorResponses = 64;
inline constexpr std::size_t kMostResponseName = 64;  ///< Bytes.
/// Wavelengths are single precision: edges of bins lie 3·10⁻⁵ nm apart from where they should.
inline constexpr double kNarrowestBin_nm = 0.1;

/// Equal bins of wavelengths; none where `count` is 0.
struct SpectralBins {
    double from_nm = 0, to_nm = 0;
    std::uint32_t count = 0;

    double width_nm() const { return (to_nm - from_nm) / count; }
    double centre_nm(std::uint32_t bin) const { return from_nm + (bin + 0.5) * width_nm(); }
    bool operator==(const SpectralBins&) const = default;
};

/// A sensor's channel: its signal for each wavelength.
struct SensorResponse {
    std::string name;
    Spectrum spectrum;  ///< At least 0, and not 0 everywhere.
};

/// As the scene specifies it.
struct SpectralFilm {
    SpectralBins bins;
    std::vector<SensorResponse> responses;
    /// A response is divided by its integral, so that radiance 1 at all wavelengths gives 1; otherwise its
    /// signal is ∫ L r dλ.
    bool normalise = true;
};

/// The channels that a film has of it: the bins, then the responses.
struct SpectralChannels {
    SpectralBins bins;
    std::vector<std::string> responses;

    std::uint32_t count() const { return bins.count + static_cast<std::uint32_t>(responses.size()); }
    bool operator==(const SpectralChannels&) const = default;
};

/// Letters, digits, '_' and '-', since it becomes the name of an EXR channel.
inline bool isResponseName(const std::string& name) {
    return !name.empty() && name.size() <= kMostResponseName &&
           std::all_of(name.begin(), name.end(), [](char c) {
               return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '_' || c == '-';
           });
}

inline bool areSpectralBins(const SpectralBins& bins) {
    return bins.count == 0 ||
           (bins.count <= kMostSpectralBins && bins.from_nm >= kWavelengthMin_nm &&
            bins.to_nm <= kWavelengthMax_nm && bins.to_nm - bins.from_nm >= kNarrowestBin_nm * bins.count);
}

/// "40 bins from 380 to 780 nm; responses: red, green"; empty for none.
inline std::string spectralText(const SpectralChannels& channels) {
    const SpectralBins& bins = channels.bins;
    std::string text;
    if (bins.count > 0)
        text = fmt::format("{} {} from {:g} to {:g} nm", bins.count, bins.count == 1 ? "bin" : "bins",
                           bins.from_nm, bins.to_nm);
    for (std::size_t i = 0; i < channels.responses.size(); ++i)
        text += (i > 0 ? ", " : text.empty() ? "responses: " : "; responses: ") + channels.responses[i];
    return text;
}

}  // namespace crt
