/*
 * tint.h: a factor, by wavelength, on what metals and gloss mirror and on what panes let through. Fresnel's
 * equations have none: it stands for what is not modelled, as pigments in a coat or in glass (OpenPBR's
 * specular_color, glTF's colour of specular reflections and of thin glass, specular_reflectance and
 * specular_transmittance of Mitsuba). The surface absorbs the rest. A metal multiplies each reflection by
 * it, those between its facets included.
 */
#ifndef CRT_TINT_H
#define CRT_TINT_H

#include "kernel/materials/scatter.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

/* Of a material by its flags and its number. */
CRT_FN vec4 crt_tint(const CrtContext *ctx, u32 flags, u32 material, const CrtSurface *surface,
                     vec4 position) {
    if (!CRT_HAS(TINT) || (flags & CRT_MATERIAL_TINTED) == 0u) return splat4(1.0f);
    CRT_GLOBAL const CrtLayers *layers = CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers) + material;
    return crt_value(ctx, layers->tint, surface, position);
}

CRT_FN vec4 crt_tinted(const CrtBsdf *b, vec4 mirrored) {
    return CRT_HAS(TINT) ? mirrored * b->tint : mirrored;
}

CRT_KERNEL_END

#endif
