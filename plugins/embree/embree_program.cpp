#include "embree_program.h"

#include "kernel/features.h"

#include <array>

namespace crt::embree {

// One per row below; kernels.cpp defines them.
RayTotals renderBox(const TileJob& job);
RayTotals renderMesh(const TileJob& job);
RayTotals renderAll(const TileJob& job);

namespace {

// CRT_EMBREE_*_FEATURES come from CMakeLists.txt, which compiles kernels.cpp with the same masks. Smallest first.
constexpr std::array<Program, 3> kPrograms{{
    {"box: a handful of diffuse triangles", CRT_EMBREE_BOX_FEATURES, renderBox},
    {"mesh: diffuse meshes", CRT_EMBREE_MESH_FEATURES, renderMesh},
    {"all features", CRT_FEATURES_ALL, renderAll},
}};

}  // namespace

const Program& chooseProgram(std::uint32_t scene_features, CrtKernelChoice choice) {
    if (choice == CRT_KERNEL_LEAN)
        for (const Program& program : kPrograms)
            if ((scene_features & ~program.features) == 0) return program;
    return kPrograms.back();
}

}  // namespace crt::embree
