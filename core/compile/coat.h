/// The clear coats of plastics, and those that lie on any material: what they reflect from above and from
/// below, worked out before rendering.
#pragma once

#include "compile/table_work.h"
#include "scene/scene.h"

#include <map>
#include <utility>
#include <vector>

namespace crt {

struct Coat {
    /// Share of light from one direction that the coat reflects, at cosines in steps of 1/470: a table of as
    /// many values as a spectrum has. Constant 0 for a smooth coat, for which the kernel evaluates Fresnel's
    /// equations.
    Spectrum albedo;
    /// Share of diffuse light from below that it sends back.
    double internal_reflectance = 0;
};

/// By index and roughness. Where the roughness depends on the place, those of CRT_COAT_ROUGHNESSES.
using Coats = std::map<std::pair<double, double>, Coat>;

const Coat& coatOf(const Coats& coats, const Material& plastic);
const Coat& coatOf(const Coats& coats, const Clearcoat& clearcoat);

/// The tables of a coat whose roughness depends on the place (coat_table.h of the kernel).
struct VaryingCoat {
    std::vector<Spectrum> albedos;  ///< By roughness; of smooth coats Fresnel's equations.
    Spectrum internal_reflectance;  ///< By roughness, at the first places; then the last one again.
};
VaryingCoat varyingCoatOf(const Coats& coats, double ior);

/// True if it has a coat itself; of a composed material, the parts have the coat.
inline bool hasClearcoat(const Material& material) {
    return material.clearcoat && !material.isComposed() && !material.transmits();
}

/// Those of all plastics among the materials, and of what lies on any of them, each worked out once, all at
/// the same time. Null materials are skipped.
void countCoats(const std::vector<const Material*>& materials, TableWork& work);
Coats coatsOf(const std::vector<const Material*>& materials);

/// Drops the coats that the process keeps, for tests that compare coats made twice.
void forgetCoats();

/// E(θ): the share that GGX microfacets of width `alpha` on an interface of relative index `eta` mirror
/// once of light from one direction, Smith's shadowing correlated by height (Heitz 2014). Midpoint rule over
/// the visible normals by spherical caps (Dupuy and Benyoub 2023); error below 3e-4 (tests/unit_bsdf.cpp).
double coatAlbedo(double cosine, double eta, double alpha);

}  // namespace crt
