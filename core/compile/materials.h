/// What surfaces are made of: materials, and what each triangle has of them.
#pragma once

#include "compile/coat.h"
#include "compile/compensation.h"
#include "compile/flatten.h"
#include "compile/rough_base.h"
#include "compile/spectrum_table.h"
#include "compile/table_work.h"
#include "compile/textures.h"
#include "kernel/layout.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

/// The materials of the blob: those of the scene, in its order, and behind them the one of faces that name
/// none, where there are such faces. Null where no triangle has it, or nothing is scattered in this view.
std::vector<const Material*> usedMaterials(const Scene& scene, const FlatScene& flat);

/// What is worked out for materials before rendering.
struct MaterialTables {
    Coats coats;
    Compensations compensations;
    RoughBases rough_bases;
};

/// Throws crt::Error(Scene) where tableWorkOf() is beyond its bound.
MaterialTables materialTablesOf(const std::vector<const Material*>& materials);

/// The work of these tables, counted without making them.
TableWork tableWorkOf(const std::vector<const Material*>& materials);

struct MaterialPart {
    std::vector<kernel::CrtMaterial> records;
    std::vector<kernel::CrtLayers> layers;  ///< As many as materials; none where no material has any.
    std::vector<kernel::CrtValue> media;  ///< Absorption of the media that surfaces bound (kernel/medium.h).
    std::uint64_t features = 0;           ///< Of the materials that are used.
};
/// Bits of a medium's number in a list of media (kernel/medium.h): 1, 2, 4, 8 or 16; 0 without media.
std::uint32_t mediumBits(std::size_t media);
MaterialPart compileMaterials(const std::vector<const Material*>& materials, const MaterialTables& tables,
                              SpectrumTable& spectra, const TexturePart& textures);

/// How the materials are composed, in their order; none where all are plain and opaque.
std::vector<kernel::CrtComposition> compileCompositions(const std::vector<const Material*>& materials,
                                                        const TexturePart& textures);

/// Fills in one a triangle, by primitive id. `light_of` as of LightPart.
void compilePrimitives(const FlatScene& flat, std::size_t scene_materials,
                       const std::vector<std::uint32_t>& light_of, std::uint32_t first_normals,
                       std::span<kernel::CrtPrimitive> primitives);

}  // namespace crt
