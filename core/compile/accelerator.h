/// Chooses the accelerator of a scene, and the order of its triangles.
#pragma once

#include "compile/bvh_build.h"
#include "compile/compile.h"
#include "compile/flatten.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt {

/// Up to this many triangles `auto` takes the brute-force loop. `bench/run accelerators` measures where the
/// tree begins to pay.
inline constexpr std::size_t kBruteForceTriangles = 64;

struct AcceleratorPart {
    std::uint32_t kind = 0;                 ///< CRT_ACCELERATOR_…
    bool without_nodes = false;             ///< As of CompiledScene.
    std::vector<kernel::CrtNode4> nodes;    ///< CRT_ACCELERATOR_BVH, unless `without_nodes`.
    std::vector<std::uint32_t> id_of_slot;  ///< Primitive ids in the order of the triangle array.
    std::vector<std::uint32_t> slot_of_id;  ///< Its inverse.
    double build_seconds = 0;               ///< As of CompiledScene.
};

/// Of the meshes that are instanced, whose triangles lie behind the slots of the scene, mesh by mesh.
struct MeshTrees {
    std::vector<kernel::CrtNode4> nodes;
    std::vector<std::uint32_t> roots;                ///< In `nodes`, one a mesh.
    std::vector<std::vector<std::uint32_t>> orders;  ///< Triangles of each mesh, in leaf order.
};
MeshTrees compileMeshTrees(const FlatScene& flat);

/// True if the backend finds all hits itself: rays start at the camera or at a surface, and surfaces lie
/// within 1.
bool backendFindsHits(const Camera& camera, const Vec3d& centre, int scale_exponent,
                      const CompileOptions& options);

AcceleratorPart compileAccelerator(const Scene& scene, const FlatScene& flat, const CompileOptions& options);

/// Coordinates are those of the compiled scene.
TriangleBounds boundsOf(const FlatScene& flat, std::size_t id);
TriangleBounds boundsOf(const kernel::CrtTriangle& triangle, float padding);

}  // namespace crt
