#include "scene/yaml/scene_spectral_film.h"

#include <fmt/format.h>

#include <utility>

namespace crt {
namespace {

SpectralBins readBins(const SectionReader& section) {
    SpectralBins bins;
    int count = 0;
    const bool from = section.read("from_nm", bins.from_nm), to = section.read("to_nm", bins.to_nm);
    if (!section.read("bins", count) || !from || !to) return {};
    bins.count = static_cast<std::uint32_t>(count);
    if (areSpectralBins(bins)) return bins;
    if (bins.from_nm >= bins.to_nm)
        section.error("to_nm", fmt::format("there are no wavelengths between {} and {} nm", bins.from_nm,
                                           bins.to_nm),
                      bins.from_nm > bins.to_nm ? "exchange 'from_nm' and 'to_nm'" : "");
    else
        section.error("bins", fmt::format("{} bins from {} to {} nm are narrower than {} nm", count,
                                          bins.from_nm, bins.to_nm, kNarrowestBin_nm),
                      fmt::format("use at most {}",
                                  static_cast<int>((bins.to_nm - bins.from_nm) / kNarrowestBin_nm)));
    return {};
}

void readResponses(const SectionReader& film, const YamlNode& map, SpectrumReader& spectra,
                   std::vector<SensorResponse>& responses) {
    Diagnostics& out = film.diagnostics();
    const ValueRange& range = film.schema().find("responses")->range;
    for (const YamlEntry& entry : map.entries) {
        if (responses.size() == kMostSensorResponses) {
            out.error(entry.key_place, fmt::format("a film has at most {} responses, and there are {}",
                                                   kMostSensorResponses, map.entries.size()));
            return;
        }
        if (!isResponseName(entry.key))
            out.error(entry.key_place,
                      fmt::format("'{}' cannot be the name of a response: it becomes an EXR channel, so it "
                                  "needs 1 to {} letters, digits, '_' or '-'",
                                  entry.key, kMostResponseName));
        std::optional<Spectrum> spectrum =
            spectra.read(*entry.value, entry.place, fmt::format("response '{}'", entry.key), range,
                         SpectrumUse::Response);
        if (!spectrum) continue;
        if (!(spectrum->max() > 0))
            out.error(entry.place, fmt::format("response '{}' is 0 at all wavelengths", entry.key));
        responses.push_back({entry.key, *std::move(spectrum)});
    }
}

}  // namespace

SpectralFilm readSpectralFilm(const SectionReader& film, SpectrumReader& spectra) {
    SpectralFilm spectral;
    if (const auto section = film.section("spectral", "the spectral film"))
        spectral.bins = readBins(*section);
    if (const YamlNode* map = film.map("responses"))
        readResponses(film, *map, spectra, spectral.responses);
    film.read("normalise_responses", spectral.normalise);
    return spectral;
}

}  // namespace crt
