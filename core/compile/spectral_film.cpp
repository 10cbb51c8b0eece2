#include "compile/spectral_film.h"

#include <numeric>
#include <vector>

namespace crt {

kernel::CrtSpan appendSpectralFilm(BlobWriter& blob, const SpectralFilm& film, std::uint32_t channels) {
    std::vector<float> tables;
    for (const SensorResponse& response : film.responses) {
        const SpectrumValues& values = response.spectrum.values;
        // Linear between nanometres, as the kernel has it.
        const double integral = film.normalise ? std::accumulate(values.begin(), values.end(), 0.0) -
                                                     0.5 * (values.front() + values.back())
                                               : 1.0;
        for (const double value : values) tables.push_back(static_cast<float>(value / integral));
        tables.push_back(tables.back());
    }
    const auto responses = static_cast<std::uint32_t>(film.responses.size());
    kernel::CrtSpectralFilm record{};
    record.channel = channels - film.bins.count - responses;
    record.bins = film.bins.count;
    if (film.bins.count > 0) {
        record.first = static_cast<float>(film.bins.from_nm - kWavelengthMin_nm);
        record.per_nm = static_cast<float>(1 / film.bins.width_nm());
    }
    record.responses = blob.append(tables);
    record.responses.count = responses;
    return blob.append(std::vector<kernel::CrtSpectralFilm>{record});
}

}  // namespace crt
