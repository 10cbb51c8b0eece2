/// Tables of the energy that microfacets lose, which rough surfaces give back
/// (kernel/materials/compensation.h). They are made before rendering.
#pragma once

#include "compile/blob_writer.h"
#include "compile/loss_table.h"
#include "compile/table_work.h"
#include "kernel/dialect/layout.h"
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
    std::vector<LossTable> tables;
    std::map<const Material*, std::uint32_t> table_of;
    /// Of rough conductors: the reflectance of their facets, its mean over the cosine. Under a film, unless
    /// that is textured.
    std::map<const Material*, Spectrum> mean_reflectance;
};

/// Those of all rough conductors and dielectrics among the materials, equal ones worked out once, all at the
/// same time. Null materials are skipped.
void countCompensations(const std::vector<const Material*>& materials, TableWork& work);
Compensations compensationsOf(const std::vector<const Material*>& materials);

/// The tables as records of the blob, in their order.
kernel::CrtSpan appendLosses(BlobWriter& blob, const Compensations& compensations);

}  // namespace crt
