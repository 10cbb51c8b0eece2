#include "compile/coat.h"

#include "base/for_avx2.h"
#include "base/memo.h"
#include "base/parallel.h"
#include "base/table_store.h"
#include "compile/reflectance.h"
#include "compile/visible_normals.h"
#include "kernel/materials/bsdf.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

namespace crt {
namespace {

constexpr std::size_t kCoatCells = kSpectrumSize - 1;

using CoatKey = std::pair<double, double>;

double alphaOf(const CoatKey& key) { return key.second * key.second; }

/// True where the kernel evaluates Fresnel's equations instead of a table.
bool isSmooth(const CoatKey& key) {
    return alphaOf(key) < static_cast<double>(CRT_ALPHA_MIN) || key.first == 1;
}

/// Gives a coat whose albedo is there the rest.
void finish(const CoatKey& key, Coat& coat) {
    const double eta = key.first;
    double mean = 0;
    if (isSmooth(key)) {
        coat.albedo = constantSpectrum(0);
        mean = cosineMean(4096, [&](double c) { return dielectricReflectance(c, eta); });
    } else {
        const Spectrum& table = coat.albedo;
        mean = cosineMean(kCoatCells, [&](double c) {
            const auto i = std::min(static_cast<std::size_t>(c * kCoatCells), kCoatCells - 1);
            return table[i] + (c * kCoatCells - static_cast<double>(i)) * (table[i + 1] - table[i]);
        });
    }
    coat.internal_reflectance = 1 - (1 - mean) / (eta * eta);
}

CoatKey coatKeyOf(const Material& plastic) { return {plastic.eta[0], plastic.roughness}; }
CoatKey coatKeyOf(const Clearcoat& coat) { return {coat.ior, coat.roughness}; }

/// The keys of a coat whose roughness depends on the place.
std::vector<CoatKey> varyingKeys(double ior) {
    std::vector<CoatKey> keys;
    for (unsigned i = 0; i < CRT_COAT_ROUGHNESSES; ++i) {
        const double root = static_cast<double>(i) / (CRT_COAT_ROUGHNESSES - 1);
        keys.emplace_back(ior, root * root);
    }
    return keys;
}

}  // namespace

CRT_FOR_AVX2_TOO double coatAlbedo(double cosine, double eta, double alpha) {
    return meanOverVisibleNormals<32, 128>(
        atCosine(cosine), {alpha, alpha}, [&](double cos_m, const Vec3d& m) {
            return dielectricReflectance(cos_m, eta) * unshadowed(cosine, 2 * cos_m * m[2] - cosine, alpha);
        });
}

const Coat& coatOf(const Coats& coats, const Material& plastic) { return coats.at(coatKeyOf(plastic)); }

const Coat& coatOf(const Coats& coats, const Clearcoat& clearcoat) { return coats.at(coatKeyOf(clearcoat)); }

VaryingCoat varyingCoatOf(const Coats& coats, double ior) {
    VaryingCoat varying;
    const auto cosineAt = [](std::size_t i) { return static_cast<double>(i) / kCoatCells; };
    for (const CoatKey& key : varyingKeys(ior)) {
        const Coat& coat = coats.at(key);
        Spectrum& albedo = varying.albedos.emplace_back(coat.albedo);
        if (isSmooth(key))
            for (std::size_t i = 0; i < kSpectrumSize; ++i)
                albedo[i] = dielectricReflectance(cosineAt(i), ior);
        varying.internal_reflectance[varying.albedos.size() - 1] = coat.internal_reflectance;
    }
    for (std::size_t i = varying.albedos.size(); i < kSpectrumSize; ++i)
        varying.internal_reflectance[i] = varying.internal_reflectance[i - 1];
    return varying;
}

namespace {

/// Calls add(key, material) for each coat among the materials, equal ones as often as they are there.
template <class Add>
void forCoats(const std::vector<const Material*>& materials, const Add& add) {
    const auto addAll = [&](const Material& material, bool varies, const CoatKey& key) {
        if (!varies) return add(key, material);
        for (const CoatKey& one : varyingKeys(key.first)) add(one, material);
    };
    for (const Material* material : materials) {
        if (material && material->type == MaterialType::Plastic)
            addAll(*material, material->hasVaryingRoughness(), coatKeyOf(*material));
        if (material && hasClearcoat(*material))
            addAll(*material, material->clearcoat->roughness_texture != kNoTexture,
                   coatKeyOf(*material->clearcoat));
    }
}

/// The albedos of coats that are not smooth.
std::vector<SpectrumValues::Array> makeAlbedos(const std::vector<CoatKey>& keys) {
    std::vector<SpectrumValues::Array> albedos(keys.size());
    std::vector<WantedTable> wanted;
    for (std::size_t k = 0; k < keys.size(); ++k)
        wanted.push_back({{keys[k].first, keys[k].second}, std::as_writable_bytes(std::span(albedos[k]))});
    TableStore().loadOrMake("albedos of coats", wanted, [&](const std::vector<std::size_t>& missing) {
        parallelFor(missing.size() * kSpectrumSize, 16, [&](std::size_t first, std::size_t end) {
            for (std::size_t n = first; n < end; ++n) {
                const std::size_t k = missing[n / kSpectrumSize], i = n % kSpectrumSize;
                const double cosine = std::max(static_cast<double>(i) / kCoatCells, 1e-4);
                albedos[k][i] = coatAlbedo(cosine, keys[k].first, alphaOf(keys[k]));
            }
        });
    });
    return albedos;
}

/// As with the tables of losses (loss_table.h).
Memo<CoatKey, SpectrumValues::Array>& keptAlbedos() {
    static Memo<CoatKey, SpectrumValues::Array> kept(256);
    return kept;
}

}  // namespace

void forgetCoats() { keptAlbedos().forget(); }

void countCoats(const std::vector<const Material*>& materials, TableWork& work) {
    // Fresnel's equations, with two roots for each direction, are dearer than shadowing.
    constexpr double kSteps = 1.7 * kSpectrumSize * 32 * 128, kStepsOfSmooth = 3 * 4096;
    std::set<CoatKey> known;
    forCoats(materials, [&](const CoatKey& key, const Material& material) {
        if (known.insert(key).second) work.add(isSmooth(key) ? kStepsOfSmooth : kSteps, material);
    });
}

Coats coatsOf(const std::vector<const Material*>& materials) {
    Coats coats;
    forCoats(materials, [&](const CoatKey& key, const Material&) { coats.try_emplace(key); });
    std::vector<std::pair<const CoatKey, Coat>*> all;
    std::vector<CoatKey> rough;
    for (auto& entry : coats) {
        all.push_back(&entry);
        if (!isSmooth(entry.first)) rough.push_back(entry.first);
    }
    const std::vector<SpectrumValues::Array> albedos = keptAlbedos().of(rough, makeAlbedos);
    for (std::size_t i = 0; i < rough.size(); ++i) coats.at(rough[i]).albedo.values = albedos[i];
    parallelFor(all.size(), 1, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) finish(all[i]->first, all[i]->second);
    });
    return coats;
}

}  // namespace crt
