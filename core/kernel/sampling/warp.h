/*
 * warp.h: uniform numbers become points and directions, and how two ways to sample share an integral.
 */
#ifndef CRT_WARP_H
#define CRT_WARP_H

#include "kernel/sampling/sampler.h"

CRT_KERNEL_BEGIN

/* A number below `chance`, or the rest, as one in [0, 1) again. */
CRT_FN f32 crt_rescaled(f32 u, f32 chance) {
    return crt_min(u < chance ? u / chance : (u - chance) / (1.0f - chance), 1.0f - CRT_EPSILON);
}

/* A uniform point on the unit disk; the square's strata stay connected (Shirley and Chiu 1997). */
CRT_FN CrtRandom2 crt_concentric_disk(CrtRandom2 u) {
    CrtRandom2 p;
    const f32 a = 2.0f * u.x - 1.0f;
    const f32 b = 2.0f * u.y - 1.0f;
    const int wide = crt_abs(a) > crt_abs(b);
    const f32 r = wide ? a : b;
    const f32 other = wide ? b : a;
    const f32 angle = r != 0.0f ? 0.78539816339744830962f * (other / r) : 0.0f;
    const f32 s = r * crt_sin_quarter(angle);
    const f32 c = r * crt_cos_quarter(angle);
    p.x = wide ? c : s;
    p.y = wide ? s : c;
    return p;
}

/* Distributed as the cosine with n, over π; unit to 4 ulp. */
CRT_FN vec3 crt_cosine_direction(vec3 n, CrtRandom2 u) {
    const CrtRandom2 disk = crt_concentric_disk(u);
    const f32 z = crt_sqrt(crt_max(0.0f, crt_fma(-disk.x, disk.x, crt_fma(-disk.y, disk.y, 1.0f))));
    return crt_to_world(crt_frame(n), make_vec3(disk.x, disk.y, z));
}

/* Density of crt_cosine_direction for a direction at the cosine cos_s from the normal, cos/π; 0 below the
   horizon. It is also f·|cos| of Lambert's surface per unit reflectance. */
CRT_FN f32 crt_lambert(f32 cos_s) { return crt_max(cos_s, 0.0f) * CRT_INV_PI; }

/* Veach's power heuristic for one sample of each of two techniques, by the ratio of the other's probability
 * to one's own. */
CRT_FN f32 crt_power_heuristic(f32 ratio) { return 1.0f / (1.0f + ratio * ratio); }

CRT_KERNEL_END

#endif
