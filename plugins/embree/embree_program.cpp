#include "embree_program.h"

#include "embree_kernels.h"

#include <array>

namespace crt::embree {

// One per row below; kernels.cpp defines them.
RayTotals renderBox(const TileJob& job);
RayTotals renderMesh(const TileJob& job);
RayTotals renderSmooth(const TileJob& job);
RayTotals renderGlossy(const TileJob& job);
RayTotals renderAll(const TileJob& job);

namespace {

// kernels.cpp is compiled with the same masks. Smallest first.
constexpr std::array<Program, 5> kPrograms{{
    {"box: a handful of diffuse triangles", CRT_EMBREE_BOX_FEATURES, renderBox},
    {"mesh: diffuse meshes", CRT_EMBREE_MESH_FEATURES, renderMesh},
    {"smooth: mirrors, metals and glass", CRT_EMBREE_SMOOTH_FEATURES, renderSmooth},
    {"glossy: metals, glass, panes and plastic of any roughness", CRT_EMBREE_GLOSSY_FEATURES, renderGlossy},
    {"all features", CRT_EMBREE_ALL_FEATURES, renderAll},
}};

}  // namespace

const Program& chooseProgram(std::uint64_t scene_features, CrtKernelChoice choice) {
    if (choice != CRT_KERNEL_FULL)
        for (const Program& program : kPrograms)
            if ((scene_features & ~program.features) == 0) return program;
    return kPrograms.back();
}

}  // namespace crt::embree
