/*
 * features.h: what a scene can need, one bit a kind. compile.cpp derives the mask from the scene; a kernel
 * compiled with CRT_FEATURES = mask leaves the rest out. Bits name kinds, never values, so moving the camera
 * never recompiles. Test with `if (CRT_HAS(X))`: every compiler still parses what it leaves out. A kernel
 * with more bits than the scene needs gives the same bits in the image, only slower.
 *
 * CRT_FEATURE_LIST(F) calls F(bit, NAME, "what leaves the kernel without it").
 *
 * CRT_MATERIAL_LIST(M, F) calls M(F, bit, NAME, SCATTER, "what leaves…") for each kind of material. Its bit is its
 * number in the scene, too. SCATTER is LOBE where light arriving from any direction may be scattered, so that
 * it is worth sampling lights, and DELTA where only single directions are.
 */
#ifndef CRT_FEATURES_H
#define CRT_FEATURES_H

#define CRT_MATERIAL_LIST(M, F)                                                              \
    M(F, 6, DIFFUSE, LOBE, "Lambertian reflection")                                          \
    M(F, 19, MIRROR, DELTA, "mirror")                                                        \
    M(F, 7, CONDUCTOR, DELTA, "smooth conductor")                                            \
    M(F, 8, DIELECTRIC, DELTA, "smooth dielectric, total internal reflection")

#define CRT_MATERIAL_FEATURE(F, bit, NAME, scatter, text) F(bit, NAME, text)
#define CRT_FEATURE_LIST(F)                                                                  \
    F(0, SOBOL, "Owen-scrambled Sobol sampler")                                              \
    F(1, INDEPENDENT, "counter-based independent sampler (Philox)")                          \
    F(2, XORSHIFT, "xorshift sampler")                                                       \
    F(3, BVH, "BVH traversal and its stack")                                                 \
    F(4, BRUTE_FORCE, "loop over all triangles")                                             \
    F(5, AABB, "per-object bounding box culling")                                            \
    CRT_MATERIAL_LIST(CRT_MATERIAL_FEATURE, F)                                               \
    F(9, DISPERSION, "wavelength-dependent refraction: hero wavelength selection")           \
    F(10, SMOOTH_NORMALS, "interpolated shading normals")                                    \
    F(11, AREA_LIGHT, "emission from surfaces")                                              \
    F(12, NEE, "light sampling, shadow rays and MIS")                                        \
    F(13, ENVIRONMENT, "constant environment")                                               \
    F(14, LENS, "thin lens")                                                                 \
    F(15, FILTER, "pixel filter other than the box")                                         \
    F(16, VIEW, "normals and bounding-box views")                                            \
    F(17, AOV, "albedo, normal, depth and primitive outputs")                                \
    F(18, REPLICATES, "independent replicates, from which the image knows its error")        \
    F(20, CONSTANT, "values that are the same at all wavelengths")                           \
    F(21, TABLE, "values tabulated by wavelength")

#define CRT_FEATURE_ENUM(bit, name, text) CRT_FEATURE_##name = 1 << bit,
enum CrtFeature { CRT_FEATURE_LIST(CRT_FEATURE_ENUM) CRT_FEATURE_END };

/* Every bit of the list. */
#define CRT_FEATURE_BIT(bit, name, text) | (1u << bit)
#define CRT_FEATURES_ALL (0u CRT_FEATURE_LIST(CRT_FEATURE_BIT))

/* The materials that scatter in more than single directions. */
#define CRT_SCATTERS_LOBE(bit) | (1u << bit)
#define CRT_SCATTERS_DELTA(bit)
#define CRT_MATERIAL_LOBE(F, bit, NAME, scatter, text) CRT_SCATTERS_##scatter(bit)
#define CRT_FEATURES_LOBE (0u CRT_MATERIAL_LIST(CRT_MATERIAL_LOBE, ))

/* The mask that this kernel is compiled for; everything when the build says nothing. */
#ifndef CRT_FEATURES
#define CRT_FEATURES CRT_FEATURES_ALL
#endif

#define CRT_HAS(name) (((CRT_FEATURES) & (unsigned)CRT_FEATURE_##name) != 0u)

#endif
