/*
 * composition.h: materials made of others.
 *
 * Of a mix, one material is chosen at each vertex, before any other use of it: light sampling and
 * scattering see the same one, so that its density alone gives the weights of both.
 */
#ifndef CRT_COMPOSITION_H
#define CRT_COMPOSITION_H

#include "kernel/sampling/sampler.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

/* The material that a ray of direction d finds on a surface. The rest of a random number after a choice
   serves as the next number. */
CRT_FN u32 crt_chosen_material(const CrtContext *ctx, const CrtSurface *surface, vec3 d, CrtSampler *sampler,
                               u32 dimension) {
    u32 material = surface->material;
    f32 u = 0.0f;
    if (ctx->scene->compositions.count == 0u) return material;
    CrtComposition c = crt_compositions(ctx)[material];
    while (c.kind != CRT_COMPOSED_PLAIN) {
        int second = dot3(d, surface->ng) > 0.0f;
        if (c.kind == CRT_COMPOSED_MIX) {
            const f32 amount = V4X(crt_value(ctx, c.amount, surface, splat4(0.0f)));
            if (u == 0.0f) u = crt_sample_1d(sampler, dimension);
            second = u < amount;
            u = second ? u / amount : (u - amount) / (1.0f - amount);
            u = crt_clamp(u, CRT_EPSILON, 1.0f - CRT_EPSILON);
        }
        material = second ? c.second : c.first;
        c = crt_compositions(ctx)[material];
    }
    return material;
}

CRT_KERNEL_END

#endif
