/// MTL materials, as tinyobjloader reads them → ours.
#pragma once

#include "scene.h"

#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>

#include <optional>
#include <set>
#include <string>

namespace crt {

/// Where a material stands and which statements it has; tinyobjloader keeps only values, and a default looks like any other.
struct MtlSource {
    std::string file;
    int line = 0;
    std::set<std::string, std::less<>> statements;
    std::string measured_reflectance;  ///< Argument of crt_reflectance: a file of a spectrum, relative to `file`.
};

struct MtlMaterial {
    Material material;
    std::optional<Emission> emission;  ///< Ke, if it is not black.
    std::string spectrum_file;         ///< Read for crt_reflectance; empty without it.
};

/// An MTL material as one of ours, by these rules, the first that fits:
///
///  1. d < 1 (Tr > 0) or illum 4, 6, 7, 9: Dielectric, smooth and clear, index Ni or 1.5. Ni alone says nothing: Blender
///     writes it for everything.
///  2. Pm ≥ 0.5: Mirror with reflectance Kd. illum 3 or 5 with Kd ≤ 0.1 and a Ks: Mirror with reflectance Ks.
///  3. Diffuse with reflectance Kd (black when there is none).
///
/// `crt_reflectance file.spd` replaces Kd or Ks of 2 and 3 by a measured spectrum. Ke, if not black, becomes the radiance of
/// a one-sided emitter. Ka is ignored. Whatever is lost on the way (roughness, gloss, partial transparency, textures) is
/// named in one warning. Throws crt::Error(Scene) for numbers that are none or make no sense, and for a spectrum that cannot be read.
MtlMaterial mapMtlMaterial(const tinyobj::material_t& mtl, const MtlSource& source);

}  // namespace crt
