/*
 * medium.h: what the light crosses between surfaces. Bodies of dielectrics absorb (Beer and Lambert); what
 * is around them does not.
 *
 * A segment that ends on the back of a body's surface has crossed that body, wherever it came from: a camera
 * may be inside. Any other segment has crossed what the path was in when it began: a body may have things
 * inside. Of bodies inside one another the inner one counts; after it, nothing, until the outer one's back.
 */
#ifndef CRT_MEDIUM_H
#define CRT_MEDIUM_H

#include "bsdf.h"

CRT_KERNEL_BEGIN

CRT_FN f32 crt_transmittance_lane(f32 absorption, f32 distance) {
    return absorption > 0.0f ? crt_exp_negative(-absorption * distance) : 1.0f; /* at infinity, too */
}

/* exp(−σ·distance) at the path's wavelengths. `distance` in lengths here. */
CRT_FN vec4 crt_transmittance(const CrtContext *ctx, CrtValue absorption, f32 distance, vec4 position) {
    const vec4 sigma = crt_value(ctx, absorption, 0, position) * ctx->scene->depth_scale;
    return make_vec4(crt_transmittance_lane(V4X(sigma), distance),
                     crt_transmittance_lane(V4Y(sigma), distance),
                     crt_transmittance_lane(V4Z(sigma), distance),
                     crt_transmittance_lane(V4W(sigma), distance));
}

/* What a ray of direction d crossed before it met `surface`, given what it began in. */
CRT_FN CrtValue crt_medium_before(const CrtContext *ctx, const CrtSurface *surface, vec3 d,
                                  CrtValue begun_in) {
    if (!(dot3(d, surface->ng) > 0.0f)) return begun_in;
    const CrtValue absorption =
        CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[surface->material].absorption;
    return absorption != 0u ? absorption : begun_in;
}

/* What a ray that leaves `surface` along w begins in, given what the one that led there began in. */
CRT_FN CrtValue crt_medium_behind(const CrtSurface *surface, const CrtBsdf *bsdf, vec3 w,
                                  CrtValue begun_in) {
    if ((bsdf->flags & CRT_BSDF_BOUNDS) == 0u) return begun_in;
    if (dot3(w, surface->ng) < 0.0f) return bsdf->absorption;
    return dot3(bsdf->wo, surface->ng) < 0.0f ? 0u : begun_in;
}

CRT_KERNEL_END

#endif
