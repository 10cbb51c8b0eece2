/// The values of a compiled scene: spectra, of which equal ones share a table of the blob, and constants,
/// which need none.
#pragma once

#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

namespace crt {

/// Of a number, at least 0.
kernel::CrtValue valueOf(double number);

class SpectrumTable {
public:
    /// A new spectrum comes behind those that the table has. Films depend on the order (scene_identity.h).
    kernel::CrtValue valueOf(const Spectrum& spectrum);
    /// Tables that follow each other, the first of them: a reference whatever they hold.
    kernel::CrtValue valueOf(const std::vector<Spectrum>& tables);
    std::uint32_t count() const { return static_cast<std::uint32_t>(floats_.size() / CRT_SPECTRUM_STRIDE); }
    /// CRT_SPECTRUM_STRIDE floats each.
    const std::vector<float>& floats() const { return floats_; }

private:
    void append(const SpectrumValues& values);

    struct Hash {
        std::size_t operator()(const SpectrumValues& values) const;
    };
    std::unordered_map<SpectrumValues, std::uint32_t, Hash> index_;
    std::map<std::vector<SpectrumValues>, std::uint32_t> sequences_;
    std::vector<float> floats_;
};

}  // namespace crt
