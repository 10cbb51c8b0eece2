#include "compile/coat.h"

#include "base/parallel.h"
#include "compile/reflectance.h"
#include "compile/visible_normals.h"
#include "kernel/bsdf.h"

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

Coat makeCoat(double eta, double roughness) {
    constexpr std::size_t cells = kSpectrumSize - 1;
    const double alpha = roughness * roughness;
    Coat coat;
    coat.albedo = constantSpectrum(0);
    double mean = 0;
    if (alpha < static_cast<double>(CRT_ALPHA_MIN) || eta == 1) {
        mean = cosineMean(4096, [&](double c) { return dielectricReflectance(c, eta); });
    } else {
        std::vector<double> table(kSpectrumSize);
        parallelFor(table.size(), 16, [&](std::size_t first, std::size_t end) {
            for (std::size_t i = first; i < end; ++i)
                table[i] = coatAlbedo(std::max(static_cast<double>(i) / cells, 1e-4), eta, alpha);
        });
        for (std::size_t i = 0; i < table.size(); ++i) coat.albedo[i] = table[i];
        mean = cosineMean(cells, [&](double c) {
            const auto i = std::min(static_cast<std::size_t>(c * cells), cells - 1);
            return table[i] + (c * cells - static_cast<double>(i)) * (table[i + 1] - table[i]);
        });
    }
    coat.internal_reflectance = 1 - (1 - mean) / (eta * eta);
    return coat;
}

using CoatKey = std::pair<double, double>;

CoatKey coatKeyOf(const Material& plastic) { return {plastic.eta[0], plastic.roughness}; }
CoatKey coatKeyOf(const Clearcoat& coat) { return {coat.ior, coat.roughness}; }

}  // namespace

double coatAlbedo(double cosine, double eta, double alpha) {
    return meanOverVisibleNormals<32, 128>(
        atCosine(cosine), {alpha, alpha}, [&](double cos_m, const Vec3d& m) {
            return dielectricReflectance(cos_m, eta) * unshadowed(cosine, 2 * cos_m * m[2] - cosine, alpha);
        });
}

const Coat& coatOf(const Coats& coats, const Material& plastic) { return coats.at(coatKeyOf(plastic)); }

const Coat& coatOf(const Coats& coats, const Clearcoat& clearcoat) { return coats.at(coatKeyOf(clearcoat)); }

Coats coatsOf(const std::vector<const Material*>& materials) {
    Coats coats;
    const auto add = [&](const CoatKey& key) {
        if (!coats.contains(key)) coats.emplace(key, makeCoat(key.first, key.second));
    };
    for (const Material* material : materials) {
        if (material && material->type == MaterialType::Plastic) add(coatKeyOf(*material));
        if (material && hasClearcoat(*material)) add(coatKeyOf(*material->clearcoat));
    }
    return coats;
}

}  // namespace crt
