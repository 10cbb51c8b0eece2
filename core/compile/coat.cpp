#include "compile/coat.h"

#include "base/parallel.h"
#include "kernel/bsdf.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace crt {
namespace {

double fresnel(double cosine, double eta) {
    const double refraction = (eta - 1) * (eta + 1) + cosine * cosine;  // (η cos of refraction)²
    if (!(refraction > 0)) return 1;
    const double cos_t = std::sqrt(refraction) / eta;
    const double rs = (cosine - eta * cos_t) / (cosine + eta * cos_t);
    const double rp = (eta * cosine - cos_t) / (eta * cosine + cos_t);
    return (rs * rs + rp * rp) / 2;
}

/// 2 ∫ E c dc, Simpson's rule in each of `cells`: exact where E is linear in them.
double cosineMean(std::size_t cells, const std::function<double(double)>& albedo) {
    const double step = 1.0 / static_cast<double>(cells);
    double sum = 0;
    for (std::size_t i = 0; i < cells; ++i) {
        const double c = static_cast<double>(i) * step;
        sum += albedo(c) * c + 4 * albedo(c + step / 2) * (c + step / 2) + albedo(c + step) * (c + step);
    }
    return sum * step / 3;
}

Coat makeCoat(double eta, double roughness) {
    constexpr std::size_t cells = kSpectrumSize - 1;
    const double alpha = roughness * roughness;
    Coat coat;
    coat.albedo = constantSpectrum(0);
    double mean = 0;
    if (alpha < static_cast<double>(CRT_ALPHA_MIN) || eta == 1) {
        mean = cosineMean(4096, [&](double c) { return fresnel(c, eta); });
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

std::pair<double, double> keyOf(const Material& plastic) { return {plastic.eta[0], plastic.roughness}; }

}  // namespace

double coatAlbedo(double cosine, double eta, double alpha) {
    constexpr int kHeights = 128, kAzimuths = 32;
    const auto root = [&](double c) { return std::sqrt(c * c + alpha * alpha * (1 - c * c)); };
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine)), root_o = root(cosine);
    const double stretch = std::hypot(alpha * sine, cosine);
    const double x = alpha * sine / stretch, z = cosine / stretch;  // w_o, stretched
    double sum = 0;
    for (int i = 0; i < kHeights; ++i)
        for (int j = 0; j < kAzimuths; ++j) {  // the other half of them is the same
            const double phi = std::numbers::pi * (j + 0.5) / kAzimuths;
            // Closer together towards normals along the surface, where what they mirror ends at the horizon.
            const double rest = 1 - (i + 0.5) / kHeights, height = rest * rest * (1 + z) - z;
            const double radius = std::sqrt(std::max(0.0, 1 - height * height));
            double m_x = alpha * (radius * std::cos(phi) + x), m_z = std::max(0.0, height + z);
            const double m_y = alpha * radius * std::sin(phi);
            const double length = std::sqrt(m_x * m_x + m_y * m_y + m_z * m_z);
            m_x /= length, m_z /= length;
            const double cos_m = std::min(1.0, sine * m_x + cosine * m_z);
            const double cos_i = 2 * cos_m * m_z - cosine;
            if (!(cos_m > 0) || !(cos_i > 0)) continue;
            // G₂ / G₁
            sum += 2 * rest * fresnel(cos_m, eta) * cos_i * (cosine + root_o) /
                   (root_o * cos_i + root(cos_i) * cosine);
        }
    return sum / (kHeights * kAzimuths);
}

const Coat& coatOf(const Coats& coats, const Material& plastic) { return coats.at(keyOf(plastic)); }

Coats coatsOf(const std::vector<const Material*>& materials) {
    Coats coats;
    for (const Material* material : materials)
        if (material && material->type == MaterialType::Plastic && !coats.contains(keyOf(*material)))
            coats.emplace(keyOf(*material), makeCoat(material->eta[0], material->roughness));
    return coats;
}

}  // namespace crt
