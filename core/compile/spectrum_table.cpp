#include "compile/spectrum_table.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>

namespace crt {

static_assert(kSpectrumSize == CRT_WAVELENGTH_COUNT && CRT_SPECTRUM_STRIDE == CRT_WAVELENGTH_COUNT + 1 &&
                  kWavelengthMin_nm == CRT_WAVELENGTH_MIN_NM,
              "the host's spectra are the kernel's tables");

std::size_t SpectrumTable::Hash::operator()(const SpectrumValues& values) const {
    std::array<double, kSpectrumSize> unsigned_zeros{};  // −0 equals 0
    for (std::size_t i = 0; i < unsigned_zeros.size(); ++i) unsigned_zeros[i] = values[i] + 0.0;
    return XXH3_64bits(unsigned_zeros.data(), sizeof unsigned_zeros);
}

kernel::CrtValue valueOf(double number) {
    // -0 has the bit of a reference.
    return std::bit_cast<kernel::CrtValue>(std::max(static_cast<float>(number), 0.0f) + 0.0f);
}

kernel::CrtValue SpectrumTable::valueOf(const Spectrum& spectrum) {
    if (spectrum.isConstant()) return crt::valueOf(spectrum[0]);
    const auto [place, fresh] = index_.try_emplace(spectrum.values, count());
    if (fresh) append(spectrum.values);
    return CRT_VALUE_TABLE | place->second;
}

kernel::CrtValue SpectrumTable::valueOf(const std::vector<Spectrum>& tables) {
    std::vector<SpectrumValues> values;
    for (const Spectrum& table : tables) values.push_back(table.values);
    const auto [place, fresh] = sequences_.try_emplace(values, count());
    if (fresh)
        for (const SpectrumValues& table : values) append(table);
    return CRT_VALUE_TABLE | place->second;
}

void SpectrumTable::append(const SpectrumValues& values) {
    for (const double v : values) floats_.push_back(static_cast<float>(v));
    floats_.push_back(floats_.back());
}

}  // namespace crt
