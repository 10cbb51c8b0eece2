/*
 * math.h: the elementary functions, frames and safe helpers of the kernel, built from IEEE operations alone
 * so that every backend computes the same bits. Errors are given in units in the last place (ulp) of the
 * result and checked against long double in tests/unit_kernel_math.cpp.
 */
#ifndef CRT_MATH_H
#define CRT_MATH_H

#include "kernel/dialect/layout.h"

CRT_KERNEL_BEGIN

#define CRT_PI 3.14159265358979323846f
#define CRT_INV_PI 0.31830988618379067154f
#define CRT_INFINITY crt_from_bits(0x7f800000u)
#define CRT_EPSILON 5.9604644775390625e-8f /* 2^-24, half an ulp of 1 */
/* Bound on the relative error of n rounded operations in sequence (Higham; PBRT 4e, 6.8.1). */
#define CRT_GAMMA(n) (((n)*CRT_EPSILON) / (1.0f - (n)*CRT_EPSILON))

CRT_FN f32 crt_min(f32 a, f32 b) { return a < b ? a : b; }
CRT_FN f32 crt_max(f32 a, f32 b) { return a > b ? a : b; }
CRT_FN f32 crt_clamp(f32 x, f32 lo, f32 hi) { return x < lo ? lo : (x > hi ? hi : x); }

/* Fused where it matters for speed: contraction is switched off everywhere, so that no compiler chooses for
 * itself, and this is the choice. */
CRT_HOT_FN f32 dot3(vec3 a, vec3 b) {
    return crt_fma(V3X(a), V3X(b), crt_fma(V3Y(a), V3Y(b), V3Z(a) * V3Z(b)));
}

/* Three numbers that lie one after another. */
CRT_HOT_FN vec3 crt_load3(CRT_GLOBAL const f32 *p) { return make_vec3(p[0], p[1], p[2]); }

/* v·s + a, rounded once. */
CRT_HOT_FN vec3 crt_fma3(vec3 v, f32 s, vec3 a) {
    return make_vec3(crt_fma(V3X(v), s, V3X(a)), crt_fma(V3Y(v), s, V3Y(a)), crt_fma(V3Z(v), s, V3Z(a)));
}

/* a·b − c·d with an error of at most 1.5 ulp, by Kahan: exact sign, so an edge shared by two triangles
   is seen alike from both, whatever the compiler contracts (Jeannerod, Louvet, Muller 2013). */
CRT_HOT_FN f32 crt_difference_of_products(f32 a, f32 b, f32 c, f32 d) {
    const f32 cd = c * d;
    const f32 error = crt_fma(-c, d, cd);
    return crt_fma(a, b, -cd) + error;
}

CRT_HOT_FN vec3 cross3(vec3 a, vec3 b) {
    return make_vec3(crt_difference_of_products(V3Y(a), V3Z(b), V3Z(a), V3Y(b)),
                     crt_difference_of_products(V3Z(a), V3X(b), V3X(a), V3Z(b)),
                     crt_difference_of_products(V3X(a), V3Y(b), V3Y(a), V3X(b)));
}

CRT_HOT_FN f32 length3(vec3 v) { return crt_sqrt(dot3(v, v)); }

CRT_HOT_FN vec3 normalize3(vec3 v) { return v * (1.0f / length3(v)); }

CRT_FN vec3 abs3(vec3 v) { return make_vec3(crt_abs(V3X(v)), crt_abs(V3Y(v)), crt_abs(V3Z(v))); }

/* One lane of four, and a vector with one lane replaced. */
CRT_FN f32 crt_lane(vec4 v, u32 lane) {
    return lane == 0u ? V4X(v) : (lane == 1u ? V4Y(v) : (lane == 2u ? V4Z(v) : V4W(v)));
}
CRT_FN vec4 crt_with_lane(vec4 v, u32 lane, f32 x) {
    return make_vec4(lane == 0u ? x : V4X(v), lane == 1u ? x : V4Y(v), lane == 2u ? x : V4Z(v),
                     lane == 3u ? x : V4W(v));
}
CRT_FN f32 sum4(vec4 v) { return (V4X(v) + V4Y(v)) + (V4Z(v) + V4W(v)); }
CRT_FN f32 max4(vec4 v) { return crt_max(crt_max(V4X(v), V4Y(v)), crt_max(V4Z(v), V4W(v))); }

/* An orthonormal basis around a unit normal (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
 */
typedef struct CrtFrame {
    vec3 s, t, n;
} CrtFrame;

CRT_FN CrtFrame crt_frame(vec3 n) {
    CrtFrame f;
    const f32 sign = V3Z(n) >= 0.0f ? 1.0f : -1.0f;
    const f32 a = -1.0f / (sign + V3Z(n));
    const f32 b = V3X(n) * V3Y(n) * a;
    f.s = make_vec3(1.0f + sign * V3X(n) * V3X(n) * a, sign * b, -sign * V3X(n));
    f.t = make_vec3(b, sign + V3Y(n) * V3Y(n) * a, -V3Y(n));
    f.n = n;
    return f;
}

CRT_FN vec3 crt_to_world(CrtFrame f, vec3 v) {
    return crt_fma3(f.s, V3X(v), crt_fma3(f.t, V3Y(v), f.n * V3Z(v)));
}

/* sin(x) and cos(x) for |x| ≤ π/4, minimax polynomials (Cephes sinf, cosf): error at most 0.74 and 0.88
   ulp,
 * over all floats. */
CRT_HOT_FN f32 crt_sin_quarter(f32 x) {
    const f32 z = x * x;
    return crt_fma(crt_fma(crt_fma(-1.9515295891e-4f, z, 8.3321608736e-3f), z, -1.6666654611e-1f) * z, x, x);
}
CRT_FN f32 crt_cos_quarter(f32 x) {
    const f32 z = x * x;
    return crt_fma(
        crt_fma(crt_fma(crt_fma(2.443315711809948e-5f, z, -1.388731625493765e-3f), z, 4.166664568298827e-2f),
                z, -0.5f),
        z, 1.0f);
}

/* sin and cos of any |x| < 64: reduction by multiples of π/2 in three parts (Cody and Waite), absolute
   error < 7.8e-8. */
CRT_HOT_FN f32 crt_sincos(f32 x, f32 *cosine) {
    const f32 q = crt_floor(x * 0.63661977236758134308f + 0.5f);
    f32 r = crt_fma(q, -1.5703125f, x);
    r = crt_fma(q, -4.83751296997070312e-4f, r);
    r = crt_fma(q, -7.54978995489188e-8f, r);
    const i32 quadrant = ((i32)q) & 3;
    const f32 s = crt_sin_quarter(r);
    const f32 c = crt_cos_quarter(r);
    const f32 sine = (quadrant & 1) ? c : s;
    const f32 cosi = (quadrant & 1) ? s : c;
    *cosine = (quadrant == 1 || quadrant == 2) ? -cosi : cosi;
    return quadrant >= 2 ? -sine : sine;
}

/* atan(x) for 0 ≤ x ≤ 1 (Cephes atanf): error at most 2.81 ulp, over all floats. */
CRT_FN f32 crt_atan_unit(f32 x) {
    f32 offset = 0.0f;
    f32 y = x;
    if (x > 0.41421356237309503f) {
        offset = 0.78539816339744830962f;
        y = (x - 1.0f) / (x + 1.0f);
    }
    const f32 z = y * y;
    const f32 p = crt_fma(crt_fma(crt_fma(8.05374449538e-2f, z, -1.38776856032e-1f), z, 1.99777106478e-1f),
                          z, -3.33329491539e-1f);
    return offset + crt_fma(p * z, y, y);
}

/* Angle of (x, y) in (−π, π]; 0 for (0, 0). Error < 4 ulp; the worst of 6e7 pairs, 3.2. */
CRT_HOT_FN f32 crt_atan2(f32 y, f32 x) {
    const f32 ax = crt_abs(x);
    const f32 ay = crt_abs(y);
    const f32 larger = crt_max(ax, ay);
    if (larger == 0.0f) return 0.0f;
    f32 angle = crt_atan_unit(crt_min(ax, ay) / larger);
    if (ay > ax) angle = 1.57079632679489661923f - angle;
    if (x < 0.0f) angle = CRT_PI - angle;
    return y < 0.0f ? -angle : angle;
}

/* exp(x) for x ≤ 0 (Cephes expf): error at most 1.01 ulp, over all floats. 0 below −87, where the result
   would be near the least normal number. */
CRT_FN f32 crt_exp_negative(f32 x) {
    if (!(x > -87.0f)) return 0.0f;
    const f32 n = crt_floor(crt_fma(x, 1.44269504088896341f, 0.5f));
    const f32 r = crt_fma(n, 2.12194440e-4f, crt_fma(n, -0.693359375f, x));
    f32 p = crt_fma(1.9875691500e-4f, r, 1.3981999507e-3f);
    p = crt_fma(p, r, 8.3334519073e-3f);
    p = crt_fma(p, r, 4.1665795894e-2f);
    p = crt_fma(p, r, 1.6666665459e-1f);
    p = crt_fma(p, r, 5.0000001201e-1f);
    return (crt_fma(p, r * r, r) + 1.0f) * crt_from_bits((u32)((i32)n + 127) << 23);
}

/* The neighbouring float towards ±infinity. */
CRT_FN f32 crt_next_up(f32 x) {
    if (x == 0.0f) return crt_from_bits(1u);
    const u32 bits = crt_bits(x);
    return crt_from_bits(x > 0.0f ? bits + 1u : bits - 1u);
}
CRT_FN f32 crt_next_down(f32 x) { return -crt_next_up(-x); }

/* Sum kept as hi + lo (Knuth's two-sum): adds `value` with an error some 2^-106 of the sum. */
typedef struct CrtSum {
    f64 hi, lo;
} CrtSum;

CRT_FN CrtSum crt_sum_add(CrtSum a, f64 value) {
    const f64 s = a.hi + value;
    const f64 b = s - a.hi;
    CrtSum r;
    r.lo = a.lo + ((a.hi - (s - b)) + (value - b));
    r.hi = s;
    return r;
}

CRT_KERNEL_END

#endif
