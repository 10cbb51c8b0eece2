/*
 * metal.h: the reflectance of metals, described by an index, by colours, or under a film.
 */
#ifndef CRT_METAL_H
#define CRT_METAL_H

#include "kernel/materials/openpbr.h"
#include "kernel/materials/thin_film.h"

CRT_KERNEL_BEGIN

/* Unpolarised reflectance of a metal, with or without a film. */
CRT_FN vec4 crt_metal_reflectance(const CrtBsdf *b, f32 cos_i) {
    if (crt_has_film(b)) return crt_film_reflectance(b, cos_i);
    if (crt_is_colored(b)) return crt_colored_reflectance(b, cos_i);
    return crt_fresnel_conductor(cos_i, b->eta, b->k);
}

CRT_KERNEL_END

#endif
