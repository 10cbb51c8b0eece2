#include "compile/rough_base.h"

#include "base/error.h"
#include "base/parallel.h"
#include "compile/reflectance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

namespace crt {
namespace {

constexpr std::size_t kCells = kSpectrumSize - 1;

double valueAt(const Spectrum& table, double cosine) {
    const double at = cosine * kCells;
    const auto i = std::min(static_cast<std::size_t>(at), kCells - 1);
    return table[i] + (at - static_cast<double>(i)) * (table[i + 1] - table[i]);
}

/// Around the normal s has the mean 0 and |s| the mean 2/π sin θ_i sin θ_o, so that of A one integral is
/// left:
///
///     A(θ_o) = T̄ + 2r/π sin θ_o (∫₀¹ T sin θ μ/max(μ, μ_o) dμ − ∫₀¹ T sin θ μ dμ)
RoughBase makeRoughBase(const Material& material, const Coat& coat) {
    const double eta = material.eta[0];
    const bool tabulated = !coat.albedo.isConstant();
    const auto passed = [&](double c) {
        return 1 - (tabulated ? valueAt(coat.albedo, c) : dielectricReflectance(c, eta));
    };
    const auto sine = [](double c) { return std::sqrt((1 - c) * (1 + c)); };
    constexpr std::size_t kSteps = 32;  // midpoints in each cell
    std::vector<double> below(kSpectrumSize, 0.0);  // ∫ T sin θ μ dμ up to the cosine
    std::vector<double> above(kSpectrumSize, 0.0);  // ∫ T sin θ dμ from the cosine on
    std::vector<double> cell(kSpectrumSize, 0.0);
    for (std::size_t i = 0; i < kCells; ++i) {
        double weighed = 0;
        for (std::size_t k = 0; k < kSteps; ++k) {
            const double c = (static_cast<double>(i * kSteps + k) + 0.5) / (kCells * kSteps);
            const double value = passed(c) * sine(c) / (kCells * kSteps);
            weighed += value * c;
            cell[i] += value;
        }
        below[i + 1] = below[i] + weighed;
    }
    for (std::size_t i = kCells; i-- > 0;) above[i] = above[i + 1] + cell[i];

    const double mean_passed = (1 - coat.internal_reflectance) * eta * eta;
    std::vector<double> more(kSpectrumSize);  // A − T̄
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const double c = static_cast<double>(i) / kCells;
        more[i] = 2 * material.diffuse_roughness / std::numbers::pi * sine(c) *
                  ((i > 0 ? below[i] / c : 0) + above[i] - below[kCells]);
    }
    const double most = *std::max_element(more.begin(), more.end());
    RoughBase base;
    base.most = mean_passed + most;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) base.loss[i] = (most - more[i]) / base.most;
    base.mean =
        cosineMean(4 * kCells, [&](double c) { return valueAt(base.loss, std::min(c, 1.0)) * passed(c); }) /
        mean_passed;
    return base;
}

}  // namespace

namespace {

/// The inputs of a base: index and roughness of the coat, its own roughness.
std::array<double, 3> keyOf(const Material& plastic) {
    return {plastic.eta[0], plastic.roughness, plastic.diffuse_roughness};
}

}  // namespace

void countRoughBases(const std::vector<const Material*>& materials, TableWork& work) {
    constexpr double kSteps = 4 * 32 * kSpectrumSize;
    std::set<std::array<double, 3>> known;
    for (const Material* material : materials) {
        if (!material || !hasRoughBase(*material)) continue;
        if (material->hasVaryingRoughness())
            throw Error(
                ErrorKind::Scene,
                fmt::format("material '{}': a rough diffuse base needs a gloss of uniform roughness, "
                            "because what it loses is tabulated",
                            material->name),
                material->place);
        if (known.insert(keyOf(*material)).second) work.add(kSteps, *material);
    }
}

RoughBases roughBasesOf(const std::vector<const Material*>& materials, const Coats& coats) {
    std::map<std::array<double, 3>, std::size_t> known;
    std::vector<const Material*> different;
    for (const Material* material : materials)
        if (material && hasRoughBase(*material) && known.try_emplace(keyOf(*material), known.size()).second)
            different.push_back(material);
    std::vector<RoughBase> made(different.size());
    parallelFor(different.size(), 1, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            made[i] = makeRoughBase(*different[i], coatOf(coats, *different[i]));
    });
    RoughBases bases;
    for (const Material* material : materials)
        if (material && hasRoughBase(*material)) bases.emplace(material, made[known.at(keyOf(*material))]);
    return bases;
}

}  // namespace crt
