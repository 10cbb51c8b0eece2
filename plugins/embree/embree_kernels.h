/// The kernels that are compiled ahead of time, with their masks by the names of features.h. CMakeLists.txt
/// compiles kernels.cpp once per mask, and embree_program.cpp chooses between the results.
#pragma once

/// Calls K(Name, NAME, lean, "what it is for") for each, smallest mask first; of equal ones the faster one.
/// `lean`: a kernel of the scene's features alone is no faster. Decision 0088 has the measurement that chose
/// the masks: fewer kernels cost scenes time, more cost every build seconds and every installation space.
#define CRT_EMBREE_KERNELS(K)                                                                       \
    K(Box, BOX, true, "box: a handful of diffuse triangles")                                        \
    K(Mesh, MESH, true, "mesh: diffuse meshes")                                                     \
    K(Smooth, SMOOTH, true, "smooth: mirrors, metals and glass")                                    \
    K(Opaque, OPAQUE, false, "opaque: metals and plastic of any roughness, spectral films")         \
    K(Daylight, DAYLIGHT, false, "daylight: metals, plastic and clear glass under lamps and skies") \
    K(Glossy, GLOSSY, false, "glossy: metals, glass, panes and plastic of any roughness")           \
    K(Textured, TEXTURED, false, "textured: daylight, textures, normal maps and mixes")             \
    K(All, ALL, false, "all features")

#define CRT_EMBREE_LIT_FEATURES                                                                 \
    (CRT_FEATURE_SOBOL | CRT_FEATURE_INDEPENDENT | CRT_FEATURE_XORSHIFT | CRT_FEATURE_DIFFUSE | \
     CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_FILTER | CRT_FEATURE_AOV |          \
     CRT_FEATURE_REPLICATES | CRT_FEATURE_TABLE)

#define CRT_EMBREE_BOX_FEATURES ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BRUTE_FORCE))
/// A tree and smooth normals.
#define CRT_EMBREE_MESH_FEATURES \
    ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BVH | CRT_FEATURE_SMOOTH_NORMALS))
/// Mirrors, metals and glass without roughness, in any shape.
#define CRT_EMBREE_SMOOTH_FEATURES                                                             \
    ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_BVH |     \
                     CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_MIRROR | CRT_FEATURE_CONDUCTOR | \
                     CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION | CRT_FEATURE_LENS |      \
                     CRT_FEATURE_ENVIRONMENT))
#define CRT_EMBREE_OPAQUE_FEATURES                                                             \
    ((unsigned long)(CRT_EMBREE_LIT_FEATURES | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_BVH |     \
                     CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_MIRROR | CRT_FEATURE_CONDUCTOR | \
                     CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC | CRT_FEATURE_LENS |    \
                     CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_SPECTRAL_FILM))
/// Skies, suns, environment images, and lights without a surface.
#define CRT_EMBREE_DAYLIGHT_FEATURES                                                                  \
    ((unsigned long)(CRT_EMBREE_SMOOTH_FEATURES | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC | \
                     CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_ENVIRONMENT_LIGHT |                        \
                     CRT_FEATURE_ENVIRONMENT_IMAGE))
#define CRT_EMBREE_TEXTURED_FEATURES                                                        \
    ((unsigned long)(CRT_EMBREE_DAYLIGHT_FEATURES | CRT_FEATURE_TEXTURE | CRT_FEATURE_MIX | \
                     CRT_FEATURE_SHAPES | CRT_FEATURE_NORMAL_MAP))
#define CRT_EMBREE_GLOSSY_FEATURES                                                                      \
    ((unsigned long)(CRT_EMBREE_SMOOTH_FEATURES | CRT_FEATURE_ROUGH_CONDUCTOR |                         \
                     CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_PLASTIC | \
                     CRT_FEATURE_MEDIA | CRT_FEATURE_THIN_FILM | CRT_FEATURE_MIX | CRT_FEATURE_ANISOTROPY))
#define CRT_EMBREE_ALL_FEATURES CRT_FEATURES_ALL

// Behind the masks: CRT_FEATURES, which it evaluates, is one of them.
#include "kernel/dialect/features.h"
