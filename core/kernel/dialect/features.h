/*
 * features.h: what a scene can need, one bit a kind. compile.cpp derives the mask from the scene; a kernel
 * compiled with CRT_FEATURES = mask leaves the rest out. Bits name kinds, never values, so moving the camera
 * never recompiles. Test with `if (CRT_HAS(X))`: every compiler still parses what it leaves out. A kernel
 * with more bits than the scene needs gives the same bits in the image, only slower.
 *
 * CRT_FEATURE_LIST(F) calls F(bit, NAME, "what leaves the kernel without it").
 *
 * CRT_MATERIAL_LIST(M, F) calls M(F, bit, NAME, Name, word, SCATTER, "what leaves…") for each kind of
 * material. Its bit is its number in the scene, too; `word` is its type in scene files. SCATTER is LOBE
 * where light that arrives from any direction may be scattered, so that it is worth sampling lights, and
 * DELTA where only that of single directions is. A material may have both: it is LOBE.
 *
 * CRT_PATTERN_LIST(P) calls P(number, NAME, Name, word, KERNELS) for each pattern: a texture that has one
 * of two values at each place. `number` is its kind in the scene, which no other texture has; `word` is its
 * key in scene files, and crt_<word> its function (values/texture.h); KERNELS is the feature of the kernels
 * that have it.
 */
#ifndef CRT_FEATURES_H
#define CRT_FEATURES_H

#define CRT_MATERIAL_LIST(M, F)                                                              \
    M(F, 6, DIFFUSE, Diffuse, diffuse, LOBE, "Lambertian reflection")                        \
    M(F, 19, MIRROR, Mirror, mirror, DELTA, "mirror")                                        \
    M(F, 7, CONDUCTOR, Conductor, conductor, DELTA, "smooth conductor")                      \
    M(F, 21, ROUGH_CONDUCTOR, RoughConductor, rough_conductor, LOBE, "rough conductor (GGX)") \
    M(F, 8, DIELECTRIC, Dielectric, dielectric, DELTA,                                       \
      "smooth dielectric, total internal reflection")                                        \
    M(F, 23, ROUGH_DIELECTRIC, RoughDielectric, rough_dielectric, LOBE,                      \
      "rough dielectric (GGX), refraction by microfacets")                                   \
    M(F, 24, THIN_DIELECTRIC, ThinDielectric, thin_dielectric, DELTA, "thin panes")          \
    M(F, 25, PLASTIC, Plastic, plastic, LOBE, "diffuse base under a clear coat")

#define CRT_PATTERN_LIST(P) P(2, CHECKER, Checker, checker, TEXTURE)

#define CRT_MATERIAL_FEATURE(F, bit, NAME, Name, word, scatter, text) F(bit, NAME, text)
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
    F(18, REPLICATES, "independent replicates, from which the error is estimated")           \
    F(20, TABLE, "values tabulated by wavelength")                                           \
    F(22, ENVIRONMENT_LIGHT, "light sampling of the environment")                            \
    F(26, MEDIA, "what bodies of glass hold: absorption, holes in their surface")            \
    F(27, TEXTURE, "values that depend on the place: images, patterns, colours of vertices") \
    F(28, POINT_LIGHT, "points, spots, directional lights, suns, IES lamps, beams")          \
    F(29, ENVIRONMENT_IMAGE, "environment that depends on the direction")                    \
    F(30, THIN_FILM, "thin films")                                                           \
    F(31, LIGHT_TREE, "a tree of lights: their choice depends on the shaded point")          \
    F(32, MIX, "mixes of materials, a material for each side")                               \
    F(33, OPACITY, "surfaces that rays may pass")                                            \
    F(34, NORMAL_MAP, "normal maps")                                                         \
    F(35, SPECTRAL_FILM, "spectral film: bins of wavelengths, responses of sensors")         \
    F(36, ANISOTROPY, "roughness that differs along the surface")                            \
    F(37, INSTANCES, "meshes that are stored once and placed many times")                    \
    F(38, ROUGH_BASE, "diffuse surfaces that are rough (EON)")                               \
    F(39, FUZZ, "fuzz on top of surfaces")                                                   \
    F(40, CLEARCOAT, "coats on top of surfaces")                                             \
    F(41, SHAPES, "spheres, disks and cylinders")                                            \
    F(42, SPLAT, "splats: samples that add to other pixels than their own")                  \
    F(43, COAT_TEXTURE, "gloss and coats whose roughness depends on the place")              \
    F(44, TINT, "colours of mirrors, gloss and panes beside those of Fresnel's equations")   \
    F(45, TRANSLUCENT, "thin sheets that let light through diffusely")                       \
    F(46, FACTOR, "images times a spectrum or colours of vertices")                          \
    F(47, EMISSION_IMAGE, "emission that depends on the place")

#define CRT_FEATURE_NUMBER(bit, name, text) CRT_BIT_##name = bit,
enum CrtFeatureNumber { CRT_FEATURE_LIST(CRT_FEATURE_NUMBER) };

#ifdef __cplusplus /* masks have 64 bits, enumerators of OpenCL C 32 */
#define CRT_FEATURE_ENUM(bit, name, text) CRT_FEATURE_##name = 1ul << bit,
enum CrtFeature : unsigned long { CRT_FEATURE_LIST(CRT_FEATURE_ENUM) };
#endif

/* Every bit of the list. */
#define CRT_FEATURE_BIT(bit, name, text) | (1ul << bit)
#define CRT_FEATURES_ALL (0ul CRT_FEATURE_LIST(CRT_FEATURE_BIT))

/* Kinds of materials by their bits; the mask of all, and of those that scatter in more than single
   directions. */
#define CRT_MATERIAL_ENUM(F, bit, NAME, Name, word, scatter, text) CRT_MATERIAL_##NAME = bit,
#define CRT_MATERIAL_BIT(F, bit, NAME, Name, word, scatter, text) | (1ul << bit)
#define CRT_SCATTERS_LOBE(bit) | (1ul << bit)
#define CRT_SCATTERS_DELTA(bit)
#define CRT_LOBE_BIT(F, bit, NAME, Name, word, scatter, text) CRT_SCATTERS_##scatter(bit)
enum CrtMaterialType { CRT_MATERIAL_LIST(CRT_MATERIAL_ENUM, ) };
#define CRT_MATERIAL_NUMBERS 64 /* above every kind's: it is a bit of a mask */
#define CRT_FEATURES_MATERIALS (0ul CRT_MATERIAL_LIST(CRT_MATERIAL_BIT, ))
#define CRT_FEATURES_LOBE (0ul CRT_MATERIAL_LIST(CRT_LOBE_BIT, ))

/* Kinds of textures. */
#define CRT_PATTERN_ENUM(number, NAME, Name, word, KERNELS) CRT_TEXTURE_##NAME = number,
enum CrtTextureKind {
    CRT_TEXTURE_SPECTRA = 0,  /* an image of spectra: three words a texel (texture.h) */
    CRT_TEXTURE_NUMBERS = 1,  /* an image of numbers: one word a texel, of 65535 */
    CRT_TEXTURE_VERTICES = 3, /* between the colours of the vertices */
    CRT_TEXTURE_NORMALS = 4,  /* an image of directions: three words a texel, −1 to 1. Not a value */
    CRT_PATTERN_LIST(CRT_PATTERN_ENUM)
};

/* The mask that this kernel is compiled for; everything when the build says nothing. */
#ifndef CRT_FEATURES
#define CRT_FEATURES CRT_FEATURES_ALL
#endif

/* The kinds of materials that it has. */
#define CRT_KERNEL_MATERIALS ((CRT_FEATURES) & CRT_FEATURES_MATERIALS)

/* True if a mask has a feature; true if this kernel has it. */
#define CRT_IN_MASK(mask, name) ((((mask) >> CRT_BIT_##name) & 1ul) != 0ul)
#define CRT_HAS(name) CRT_IN_MASK(CRT_FEATURES, name)

/* True if this kernel and the scene have a feature. CRT_LEAN is 1 where the kernel is compiled for scenes
   that have all of its features: then this is known while it is compiled, and the other case is left out. */
#ifndef CRT_LEAN
#define CRT_LEAN 0
#endif
#define CRT_SCENE_HAS(scene, name) \
    (CRT_HAS(name) &&              \
     ((CRT_LEAN && CRT_IN_MASK(CRT_FEATURES, name)) || CRT_IN_MASK((scene)->features, name)))

#endif
