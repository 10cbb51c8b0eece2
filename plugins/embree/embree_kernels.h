/// The masks that kernels.cpp is compiled with, by the names of features.h. CMakeLists.txt compiles it once
/// per mask, and embree_program.cpp chooses between the results: both take the masks from here.
#pragma once

#define CRT_EMBREE_LIT_FEATURES                                                                 \
    (CRT_FEATURE_SOBOL | CRT_FEATURE_INDEPENDENT | CRT_FEATURE_XORSHIFT | CRT_FEATURE_DIFFUSE | \
     CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_FILTER | CRT_FEATURE_AOV |          \
     CRT_FEATURE_REPLICATES | CRT_FEATURE_TABLE)

/// A handful of diffuse triangles.
#define CRT_EMBREE_BOX_FEATURES ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BRUTE_FORCE))
/// Diffuse meshes: a tree and smooth normals.
#define CRT_EMBREE_MESH_FEATURES \
    ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BVH | CRT_FEATURE_SMOOTH_NORMALS))
/// Mirrors, metals and glass without roughness, in any shape.
#define CRT_EMBREE_SMOOTH_FEATURES                                                             \
    ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_BVH |     \
                     CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_MIRROR | CRT_FEATURE_CONDUCTOR | \
                     CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION | CRT_FEATURE_LENS |      \
                     CRT_FEATURE_ENVIRONMENT))
/// Metals, glass, panes and plastic of any roughness, untextured, under lights with a surface.
#define CRT_EMBREE_GLOSSY_FEATURES                                                                      \
    ((unsigned long)(CRT_EMBREE_SMOOTH_FEATURES | CRT_FEATURE_ROUGH_CONDUCTOR |                         \
                     CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_PLASTIC | \
                     CRT_FEATURE_MEDIA | CRT_FEATURE_THIN_FILM | CRT_FEATURE_MIX | CRT_FEATURE_ANISOTROPY))
/// Every scene.
#define CRT_EMBREE_ALL_FEATURES CRT_FEATURES_ALL

// Behind the masks: CRT_FEATURES, which it evaluates, is one of them.
#include "kernel/dialect/features.h"
