// Spectrum files (.spd, .csv) → Spectrum, in all three ways of treating what lies outside the data.
#include "fuzz_target.h"

#include "spectra/spectra.h"

#include <cmath>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    const std::string path = directory.write("a.spd", data, size);
    for (const Outside outside : {Outside::Error, Outside::Clamp, Outside::Zero})
        fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
            const Spectrum spectrum = readSpectrumFile(path, outside);
            for (const double value : spectrum.values)
                if (!std::isfinite(value)) fuzz::finding("spectrum", "a value is not finite");
        });
    return 0;
}
