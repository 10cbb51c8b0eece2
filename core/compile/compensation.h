/// What rough surfaces give back of the light that their microfacets lose (kernel/compensation.h): tables of
/// the losses, worked out before rendering.
#pragma once

#include "compile/blob_writer.h"
#include "kernel/layout.h"
#include "scene/scene.h"

#include <cstdint>
#include <map>
#include <vector>

namespace crt {

inline bool hasThinFilm(const Material& material) { return material.film_thickness_nm > 0; }

/// The narrower width of GGX is at least this share of the wider one.
inline constexpr double kLeastNarrowing = 0.02;

/// Widths of GGX as OpenPBR Surface 1.1 says: along the tangent `widening` times the roughness squared,
/// across it `narrowing` times that. 0: the surface is isotropic, or smooth.
struct Anisotropy {
    double widening = 1, narrowing = 0;
};
Anisotropy anisotropyOf(const Material& material);

struct Compensations {
    /// Rows by roughness, of which equal ones are shared.
    struct Table {
        std::vector<float> rows;
        kernel::CrtLoss record{};  ///< Without its place in the blob.
    };
    std::vector<Table> tables;
    std::map<const Material*, std::uint32_t> table_of;
    /// Of rough conductors: Fresnel's reflectance, its mean over the cosine.
    std::map<const Material*, Spectrum> mean_reflectance;
};

/// Those of all rough conductors and dielectrics among the materials. Null materials are skipped.
Compensations compensationsOf(const std::vector<const Material*>& materials);

/// The tables as records of the blob, in their order.
kernel::CrtSpan appendLosses(BlobWriter& blob, const Compensations& compensations);

/// L(θ): the share of light towards a view at `cosine` that GGX microfacets of width `alpha` lose between
/// them, mirrored (and, unless `eta` is 0, refracted) once, Smith's shadowing correlated by height. `eta`:
/// index beyond over index before; 0: all light is mirrored.
double microfacetLoss(double cosine, double eta, double alpha);

}  // namespace crt
