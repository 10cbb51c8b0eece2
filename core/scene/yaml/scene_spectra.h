/// The forms a spectrum can take in a scene, resolved to the 1 nm grid.
#pragma once

#include "scene/yaml/scene_reader.h"

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace crt {

/// Every value times the factor.
Spectrum scaled(Spectrum spectrum, double factor);

/// Purpose of a spectrum. An rgb colour means another spectrum as a reflectance than as a light.
enum class SpectrumUse { Reflectance, Emission, Index, White, Absorption, Response };

class SpectrumReader {
public:
    /// `named` is the scene's `spectra:` map, or null. All references live as long as the reader.
    SpectrumReader(Diagnostics& out, SceneFiles& files, const YamlNode* named);

    /// The spectrum under `key`, checked against the range of the table. Nothing when it is absent or wrong.
    std::optional<Spectrum> read(const SectionReader& section, std::string_view key, SpectrumUse use);

    /// The spectrum that `node` is; `what` as in messages.
    std::optional<Spectrum> read(const YamlNode& node, const YamlPlace& place, const std::string& what,
                                 const ValueRange& range, SpectrumUse use);

    /// Checks the named spectra that nothing used, and warns about them.
    void finish();

    /// The named spectra that light or a white balance was made of and that can be seen: XYZ with Y = 1.
    std::map<std::string, Vec3d> whites() const;

private:
    /// `what` names the value in messages: "'reflectance' of material 'white'", "spectrum 'white'".
    std::optional<Spectrum> resolve(const YamlNode& node, const YamlPlace& place, const std::string& what,
                                    SpectrumUse use);
    std::optional<Spectrum> resolveName(const std::string& name, const YamlPlace& place, SpectrumUse use);
    std::optional<Spectrum> resolveForm(const SectionReader& form, SpectrumUse use);
    std::optional<Spectrum> table(const SectionReader& form);
    std::optional<Spectrum> file(const SectionReader& form);
    std::optional<Spectrum> rgb(const SectionReader& form, SpectrumUse use);
    std::optional<Spectrum> sellmeier(const SectionReader& form);
    std::optional<Spectrum> data(const SectionReader& form);

    Diagnostics& out_;
    SceneFiles& files_;
    const YamlNode* named_;
    std::unordered_map<std::string_view, const YamlEntry*>
        entry_of_;  ///< Of named_, which may hold a hundred thousand.
    std::map<std::pair<std::string, SpectrumUse>, std::optional<Spectrum>> resolved_;
    std::map<double, Spectrum> constants_;
    std::map<std::pair<Vec3d, bool>, Spectrum> colors_;  ///< Of linear sRGB, as reflectance or as emission.
    std::set<std::string> used_;
    std::set<std::string> open_;  ///< Names being resolved: meeting one again is a cycle.
};

}  // namespace crt
