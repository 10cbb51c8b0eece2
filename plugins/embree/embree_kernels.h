/// The kernels that are compiled ahead of time, with their masks by the names of features.h. CMakeLists.txt
/// compiles kernels.cpp once per mask, and embree_program.cpp chooses between the results.
#pragma once

/// Calls K(Name, NAME, lean, "what it is for") for each, smallest mask first; of equal ones the faster one.
/// `lean`: a kernel of the scene's features alone is no faster. Decision 0088 has the measurement that chose
/// the masks: fewer kernels cost a scene time, more kernels cost every build seconds.
#define CRT_EMBREE_KERNELS(K)                                                                              \
    K(Box, BOX, true, "box: a handful of diffuse triangles")                                               \
    K(Mesh, MESH, true, "mesh: diffuse meshes")                                                            \
    K(Smooth, SMOOTH, true, "smooth: mirrors, metals and glass")                                           \
    K(Opaque, OPAQUE, false, "opaque: metals and plastic of any roughness, spectral films")                \
    K(Daylight, DAYLIGHT, false, "daylight: metals, plastic and clear glass under lamps and skies")        \
    K(Frosted, FROSTED, false, "frosted: daylight, rough glass and panes")                                 \
    K(Textured, TEXTURED, false, "textured: daylight, textures, mixes and shapes")                         \
    K(Mapped, MAPPED, false, "mapped: daylight, textures, mixes and normal maps")                          \
    K(Glossy, GLOSSY, false, "glossy: metals, glass, panes and plastic of any roughness")                  \
    K(Coated, COATED, false, "coated: metals, plastic and clear glass under coats and fuzz, and textures") \
    K(Cutout, CUTOUT, false, "cutout: textured, holes, rough glass and panes")                             \
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
#define CRT_EMBREE_FROSTED_FEATURES                                                \
    ((unsigned long)(CRT_EMBREE_DAYLIGHT_FEATURES | CRT_FEATURE_ROUGH_DIELECTRIC | \
                     CRT_FEATURE_THIN_DIELECTRIC))
#define CRT_EMBREE_TEXTURED_FEATURES                                                        \
    ((unsigned long)(CRT_EMBREE_DAYLIGHT_FEATURES | CRT_FEATURE_TEXTURE | CRT_FEATURE_MIX | \
                     CRT_FEATURE_SHAPES))
#define CRT_EMBREE_MAPPED_FEATURES                                                          \
    ((unsigned long)(CRT_EMBREE_DAYLIGHT_FEATURES | CRT_FEATURE_TEXTURE | CRT_FEATURE_MIX | \
                     CRT_FEATURE_NORMAL_MAP))
/// Untextured, under lights with a surface.
#define CRT_EMBREE_GLOSSY_FEATURES                                                                      \
    ((unsigned long)(CRT_EMBREE_SMOOTH_FEATURES | CRT_FEATURE_ROUGH_CONDUCTOR |                         \
                     CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_PLASTIC | \
                     CRT_FEATURE_MEDIA | CRT_FEATURE_THIN_FILM | CRT_FEATURE_MIX | CRT_FEATURE_ANISOTROPY))
/// Under lights with a surface, many of them too.
#define CRT_EMBREE_COATED_FEATURES                                                                        \
    ((unsigned long)(CRT_EMBREE_SMOOTH_FEATURES | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC |     \
                     CRT_FEATURE_ROUGH_BASE | CRT_FEATURE_FUZZ | CRT_FEATURE_CLEARCOAT |                  \
                     CRT_FEATURE_TEXTURE | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_MIX | CRT_FEATURE_MEDIA | \
                     CRT_FEATURE_LIGHT_TREE))
#define CRT_EMBREE_CUTOUT_FEATURES                                                                      \
    ((unsigned long)(CRT_EMBREE_TEXTURED_FEATURES | CRT_EMBREE_FROSTED_FEATURES | CRT_FEATURE_OPACITY | \
                     CRT_FEATURE_ROUGH_BASE))
#define CRT_EMBREE_ALL_FEATURES CRT_FEATURES_ALL

// Behind the masks: CRT_FEATURES, which it evaluates, is one of them.
#include "kernel/dialect/features.h"
