/*
 * metal.h: the reflectance of metals, described by an index, by colours, or under a film.
 */
#ifndef CRT_METAL_H
#define CRT_METAL_H

#include "kernel/materials/openpbr.h"
#include "kernel/materials/thin_film.h"
#include "kernel/materials/tint.h"

CRT_KERNEL_BEGIN

/* Unpolarised reflectance of a metal, with or without a film. */
CRT_HOT_FN vec4 crt_metal_reflectance(const CrtBsdf *b, f32 cos_i) {
    if (crt_has_film(b)) return crt_tinted(b, crt_film_reflectance(b, cos_i));
    if (crt_is_colored(b)) return crt_tinted(b, crt_colored_reflectance(b, cos_i));
    return crt_tinted(b, crt_fresnel_conductor(cos_i, b->eta, b->k));
}

/* The mean of that over the cosine. The scene's compiler makes it, unless a texture says how thick the film
   is. */
CRT_FN vec4 crt_metal_mean(const CrtContext *ctx, const CrtBsdf *b, const CrtMaterial *material,
                           const CrtSurface *surface, vec4 position) {
    const int textured = CRT_HAS(TEXTURE) && crt_from_bits(material->film_thickness) != 1.0f;
    if (textured && crt_has_film(b)) return crt_tinted(b, crt_film_mean(b));
    if (crt_is_colored(b)) return crt_tinted(b, crt_colored_mean(b));
    return crt_tinted(b, crt_value(ctx, material->of.metal.mean, surface, position));
}

CRT_KERNEL_END

#endif
