#include "compile/compensation.h"

#include "base/parallel.h"
#include "compile/reflectance.h"
#include "kernel/materials/bsdf.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <tuple>
#include <utility>

namespace crt {
namespace {

/// The most rows along an index that depends on the wavelength: one for each 0.02 of it.
constexpr std::uint32_t kMostIndices = 33;
constexpr double kIndexStep = 0.02;
/// The same of anisotropic ones, of which each index has as many rows as there are azimuths.
constexpr double kWideIndexStep = 0.1;

/// As the kernel decides it.
bool isSmooth(double roughness) {
    const float r = static_cast<float>(roughness);
    return !(r * r >= CRT_ALPHA_MIN);
}

LossKey tableKeyOf(const Material& material) {
    LossKey key{};
    key.refracts = material.type == MaterialType::RoughDielectric;
    if (key.refracts) std::tie(key.least, key.most) = std::pair(material.eta.min(), material.eta.max());
    key.textured = material.hasVaryingRoughness();
    if (!key.textured) key.roughness = material.roughness;
    if (const Anisotropy a = anisotropyOf(material); a.narrowing > 0) {
        key.narrowing = a.narrowing;
        key.roughness = material.roughness * std::sqrt(a.widening);
    }
    return key;
}

Across acrossIndices(const LossKey& key) {
    Across across;
    const double range = key.most - key.least, step = key.narrowing > 0 ? kWideIndexStep : kIndexStep;
    const auto steps = static_cast<std::size_t>(std::min(kMostIndices - 1.0, std::ceil(range / step)));
    across.first = key.least;
    if (steps > 0) across.step = range / static_cast<double>(steps);
    across.interfaces.resize(steps + 1);
    for (std::size_t i = 0; i <= steps; ++i)
        across.interfaces[i].index = key.least + static_cast<double>(i) * across.step;
    return across;
}

/// Wavelengths so close that a fringe of the film has eight of them.
Across acrossWavelengths(const Material& material) {
    constexpr double kLast = kSpectrumSize - 1;
    const double fringes = 2 * material.film_thickness_nm * material.film_index.max() *
                           (1 / kWavelengthMin_nm - 1 / (kWavelengthMin_nm + kLast));
    const auto steps = static_cast<std::size_t>(std::clamp(std::ceil(8 * fringes), 8.0, 64.0));
    Across across;
    across.step = kLast / static_cast<double>(steps);
    across.interfaces.resize(steps + 1);
    for (std::size_t i = 0; i <= steps; ++i) {
        const double position = static_cast<double>(i) * across.step;
        const auto at = [&](const Spectrum& s) {
            const auto n = std::min<std::size_t>(static_cast<std::size_t>(position), kSpectrumSize - 2);
            return s[n] + (position - static_cast<double>(n)) * (s[n + 1] - s[n]);
        };
        across.interfaces[i] = {at(material.eta), at(material.film_index),
                                2 * material.film_thickness_nm / (kWavelengthMin_nm + position)};
    }
    return across;
}

/// The film is as thick everywhere.
bool hasEvenFilm(const Material& material) {
    return hasThinFilm(material) && material.film_texture == kNoTexture;
}

double reflectanceUnderFilm(const Material& metal, std::size_t i, double cosine) {
    const double rounds = 2 * metal.film_thickness_nm / (kWavelengthMin_nm + static_cast<double>(i));
    return kernel::crt_film_reflectance_lane(
        static_cast<float>(cosine), static_cast<float>(metal.film_index[i]), static_cast<float>(rounds),
        static_cast<float>(metal.eta[i]), static_cast<float>(metal.k[i]));
}

/// Cells for each fringe that the film may have between straight on and grazing.
constexpr double kCellsOfFringe = 4;

std::size_t cellsOf(const Material& metal) {
    if (!hasEvenFilm(metal)) return 64;
    const double fringes = 2 * metal.film_thickness_nm * metal.film_index.max() / kWavelengthMin_nm;
    return static_cast<std::size_t>(std::clamp(std::ceil(kCellsOfFringe * fringes), 16.0, 64.0));
}

bool isGrey(const Material& metal) {
    return metal.eta.isConstant() && metal.k.isConstant() && !hasEvenFilm(metal);
}

Spectrum meanReflectance(const Material& metal) {
    Spectrum mean;
    const auto at = [&](std::size_t i) {
        return cosineMean(cellsOf(metal), [&](double c) {
            return hasEvenFilm(metal) ? reflectanceUnderFilm(metal, i, c)
                                      : conductorReflectance(c, metal.eta[i], metal.k[i]);
        });
    };
    if (isGrey(metal)) return constantSpectrum(at(0));
    for (std::size_t i = 0; i < kSpectrumSize; ++i) mean[i] = at(i);
    return mean;
}

}  // namespace

Anisotropy anisotropyOf(const Material& material) {
    Anisotropy a;
    const double width = material.roughness * material.roughness, across = 1 - material.anisotropy;
    const bool rough =
        material.type == MaterialType::RoughConductor || material.type == MaterialType::RoughDielectric;
    if (!rough || !(material.anisotropy > 0) || isSmooth(material.roughness)) return a;
    a.widening = std::sqrt(2 / (1 + across * across));
    double least = CRT_ALPHA_MIN;
    if (material.type == MaterialType::RoughDielectric) {
        const double bend = std::min(std::abs(material.eta.min() - 1), std::abs(material.eta.max() - 1));
        if (bend > 0) least = std::max(least, static_cast<double>(CRT_BEND_MIN) / bend);
    }
    a.narrowing = std::min(1.0, std::max({across, kLeastNarrowing, least / (width * a.widening)}));
    return a;
}

namespace {

bool hasMeanReflectance(const Material& material) {
    return material.type == MaterialType::RoughConductor && !material.by_color;
}

bool hasTable(const Material& material) {
    return (material.type == MaterialType::RoughConductor ||
            material.type == MaterialType::RoughDielectric) &&
           (material.hasVaryingRoughness() || !isSmooth(material.roughness));
}

/// A film changes a table of glass.
bool isBehindFilm(const Material& material) {
    return material.type == MaterialType::RoughDielectric && hasThinFilm(material);
}

Across acrossOf(const Material& material, const LossKey& key) {
    if (isBehindFilm(material)) return acrossWavelengths(material);
    return key.refracts ? acrossIndices(key) : Across{};
}

/// The inputs of a table of glass behind a film, besides its key.
using FilmKey = std::tuple<LossKey, double, SpectrumValues, SpectrumValues>;

FilmKey filmKeyOf(const Material& material) {
    return {tableKeyOf(material), material.film_thickness_nm, material.film_index.values,
            material.eta.values};
}

using MetalKey = std::tuple<SpectrumValues, SpectrumValues, double, SpectrumValues>;

MetalKey metalKeyOf(const Material& material) {
    if (!hasEvenFilm(material)) return {material.eta.values, material.k.values, 0, {}};
    return {material.eta.values, material.k.values, material.film_thickness_nm, material.film_index.values};
}

/// Each is worked out once for materials with equal keys.
std::map<const Material*, Spectrum> meanReflectances(const std::vector<const Material*>& materials) {
    std::map<MetalKey, std::size_t> known;
    std::vector<const Material*> different;
    for (const Material* material : materials)
        if (material && hasMeanReflectance(*material) &&
            known.try_emplace(metalKeyOf(*material), known.size()).second)
            different.push_back(material);
    std::vector<Spectrum> made(different.size());
    parallelFor(different.size(), 1, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) made[i] = meanReflectance(*different[i]);
    });
    std::map<const Material*, Spectrum> all;
    for (const Material* material : materials)
        if (material && hasMeanReflectance(*material)) all[material] = made[known.at(metalKeyOf(*material))];
    return all;
}

}  // namespace

void countCompensations(const std::vector<const Material*>& materials, TableWork& work) {
    constexpr double kStepsOfCell = 2 * 3;
    std::set<LossKey> tables;
    std::set<FilmKey> films;
    std::set<MetalKey> metals;
    for (const Material* material : materials) {
        if (!material) continue;
        if (hasMeanReflectance(*material) && metals.insert(metalKeyOf(*material)).second) {
            const double cells = static_cast<double>(cellsOf(*material));
            work.add(kStepsOfCell * cells * (isGrey(*material) ? 1 : kSpectrumSize), *material);
        }
        if (!hasTable(*material)) continue;
        const LossKey key = tableKeyOf(*material);
        const bool fresh = isBehindFilm(*material) ? films.insert(filmKeyOf(*material)).second
                                                   : tables.insert(key).second;
        if (fresh) work.add(stepsOf({key, acrossOf(*material, key)}), *material);
    }
}

Compensations compensationsOf(const std::vector<const Material*>& materials) {
    Compensations all;
    all.mean_reflectance = meanReflectances(materials);
    std::map<LossKey, std::uint32_t> known;
    std::map<FilmKey, std::size_t> films;
    std::vector<LossPlan> plans;
    std::vector<std::size_t> plan_of;  // Tables behind films are not shared, only their values are.
    for (const Material* material : materials) {
        if (!material || !hasTable(*material)) continue;
        const LossKey key = tableKeyOf(*material);
        const auto number = static_cast<std::uint32_t>(plan_of.size());
        if (isBehindFilm(*material)) {
            const auto [film, fresh] = films.try_emplace(filmKeyOf(*material), plans.size());
            if (fresh) plans.push_back({key, acrossOf(*material, key)});
            plan_of.push_back(film->second);
            all.table_of[material] = number;
            continue;
        }
        const auto [found, fresh] = known.try_emplace(key, number);
        if (fresh) {
            plan_of.push_back(plans.size());
            plans.push_back({key, acrossOf(*material, key)});
        }
        all.table_of[material] = found->second;
    }
    const std::vector<LossTable> made = lossTablesOf(plans);
    for (const std::size_t plan : plan_of) all.tables.push_back(made[plan]);
    return all;
}

kernel::CrtSpan appendLosses(BlobWriter& blob, const Compensations& compensations) {
    std::vector<kernel::CrtLoss> records;
    for (const LossTable& table : compensations.tables) {
        records.push_back(table.record);
        records.back().rows = blob.append(table.rows);
    }
    return blob.append(records);
}

}  // namespace crt
