/*
 * shading_normal.h: what becomes of the light that a BSDF about an interpolated normal sends below the
 * surface, so that a surface that reflects sends on all of it (docs/decisions/0029-interpolated-normals.md):
 *
 *   - of Lambert's lobe a share b = (1 − cos θ)/2 at a tilt θ. It is raised, and leaves as Lambert's
 *     light about the surface's own normal does: f·cos = (max(0, n_s·w) + b n_g·w)/π. At the horizon
 *     that is no more than there was, so that faces do not show in the light of one lamp;
 *   - everything else is mirrored up by the surface. That counts among the single directions beside a lobe:
 *     scattered rays alone follow it.
 *
 * Glass keeps its light in the same way (docs/decisions/0060-glass-with-interpolated-normals.md): what it
 * reflects to below the face is mirrored up, and what it refracts to above the face is mirrored down.
 *
 * A viewer behind the shading normal is taken for one as far before it: what is mirrored is then mirrored by
 * the geometry, without a seam where the shading normal turns away.
 */
#ifndef CRT_SHADING_NORMAL_H
#define CRT_SHADING_NORMAL_H

#include "kernel/dialect/context.h"
#include "kernel/materials/scatter.h"

CRT_KERNEL_BEGIN

CRT_FN vec3 crt_mirrored(vec3 v, vec3 n) { return crt_fma3(n, -2.0f * dot3(v, n), v); }

/* True if it scatters Lambert's light to both sides. */
CRT_FN int crt_is_translucent(const CrtBsdf *b) {
    const u32 both = CRT_BSDF_TRANSMITS | CRT_BSDF_RAISES;
    return CRT_HAS(TRANSLUCENT) && (b->flags & both) == both;
}

CRT_FN int crt_is_facet(const CrtBsdf *b) { return CRT_HAS(NORMAL_MAP) && b->facet; }

/* Kinds of materials that reflect alone, in a lobe other than Lambert's. */
#define CRT_FEATURES_GLOSSY \
    (CRT_FEATURES_LOBE & ~(1ul << CRT_BIT_DIFFUSE | 1ul << CRT_BIT_ROUGH_DIELECTRIC))
#define CRT_HAS_GLOSSY ((CRT_KERNEL_MATERIALS & CRT_FEATURES_GLOSSY) != 0ul)

/* Puts w_o and the shading normal on one side, of materials that are not Lambertian. Glossy reflection
   mirrors w_o; all others take the normal of the face, and w_o stays the same. */
CRT_FN void crt_face_viewer(CrtBsdf *b, int transmits) {
    if (dot3(b->wo, b->ns) > 0.0f) return;
    if (CRT_HAS_GLOSSY && !transmits && ((CRT_FEATURES_GLOSSY >> b->type) & 1ul) != 0ul)
        b->wo = crt_mirrored(b->wo, b->ns);
    else if (b->type != CRT_MATERIAL_DIFFUSE)
        b->ns = b->ng;
}

/* Of a surface that reflects alone, the share of Lambert's light that goes below it. */
CRT_FN f32 crt_below(const CrtBsdf *b) {
    if (!CRT_HAS(SMOOTH_NORMALS) || crt_is_facet(b)) return 0.0f;
    const vec3 off = b->ns - b->ng;
    return 0.25f * dot3(off, off);
}

/* f·cos of Lambert's light per unit reflectance, and its density. */
CRT_FN f32 crt_lambert_pdf(const CrtBsdf *b, vec3 wi) {
    const f32 lobe = crt_lambert(dot3(wi, b->ns));
    if (!CRT_HAS(SMOOTH_NORMALS)) return lobe;
    return lobe + crt_below(b) * crt_lambert(dot3(wi, b->ng));
}

/* A direction of Lambert's lobe, raised if it is below the surface. In the plane of both normals those
   below lie between the ellipse cos θ √(1 − y²) and the circle √(1 − y²), seen along n_s; that
   crescent is stretched over the disk that is seen along n_g. The horizon stays where it is. */
CRT_FN vec3 crt_lift(const CrtBsdf *b, vec3 wi) {
    if (!CRT_HAS(SMOOTH_NORMALS) || dot3(wi, b->ng) > 0.0f) return wi;
    const f32 below = crt_below(b);
    if (!(below > 0.0f)) return wi;
    const f32 cosine = 1.0f - 2.0f * below;
    const f32 inverse_sine = 0.5f / crt_sqrt(below * (1.0f - below));
    const vec3 away = (b->ns * cosine - b->ng) * inverse_sine;    /* across n_s */
    const vec3 towards = (b->ns - b->ng * cosine) * inverse_sine; /* across n_g */
    const f32 x = dot3(wi, away), z = dot3(wi, b->ns);
    const f32 radius = crt_sqrt(x * x + z * z);
    const f32 share = crt_clamp((x / radius - cosine) / (2.0f * below), 0.0f, 1.0f);
    const f32 height = 2.0f * crt_sqrt(share * (1.0f - share));
    const vec3 up = towards * (1.0f - 2.0f * share) + b->ng * height;
    return normalize3(wi - away * x - b->ns * z + up * radius);
}

/* Cosine with n_s of the direction that was raised to one at cos_s and cos_g with n_s and n_g. */
CRT_FN f32 crt_cosine_before_lift(f32 below, f32 cos_s, f32 cos_g) {
    const f32 cosine = 1.0f - 2.0f * below;
    const f32 x = (cos_s - cos_g * cosine) * (0.5f / crt_sqrt(below * (1.0f - below)));
    const f32 square = x * x + cos_g * cos_g;
    const f32 radius = crt_sqrt(square);
    const f32 before = crt_fma(radius - x, below, cosine * radius);
    return crt_sqrt(crt_max(square - before * before, 0.0f));
}

/* That direction, at the cosine cos_s with n_s, of one that was raised to wi. */
CRT_FN vec3 crt_before_lift(const CrtBsdf *b, f32 below, vec3 wi, f32 cos_s) {
    const f32 cosine = 1.0f - 2.0f * below;
    const vec3 away = (b->ns * cosine - b->ng) * (0.5f / crt_sqrt(below * (1.0f - below)));
    const f32 x = dot3(wi, away), z = dot3(wi, b->ns);
    const f32 before = crt_sqrt(crt_max(x * x + z * z - cos_s * cos_s, 0.0f));
    return wi + away * (before - x) + b->ns * (cos_s - z);
}

CRT_FN CrtScatter crt_sample_lambert(const CrtBsdf *b, CrtRandom2 u) {
    if (!CRT_HAS(SMOOTH_NORMALS)) return crt_sample_diffuse(b->reflectance, b->ns, b->ng, u);
    CrtScatter s = crt_no_scatter();
    s.wi = crt_lift(b, crt_cosine_direction(b->ns, u));
    s.weight = b->reflectance;
    s.pdf = crt_lambert_pdf(b, s.wi);
    s.valid = dot3(s.wi, b->ng) > 0.0f && s.pdf > 0.0f;
    return s;
}

/* Mirrors a direction up that goes below the surface. */
CRT_FN CrtScatter crt_mirror_up(const CrtBsdf *b, CrtScatter s) {
    if (!CRT_HAS(SMOOTH_NORMALS) || !s.valid) return s;
    if (dot3(s.wi, b->ng) < 0.0f) {
        s.wi = crt_mirrored(s.wi, b->ng);
        s.pdf = 0.0f;
    }
    s.valid = dot3(s.wi, b->ng) > 0.0f;
    return s;
}

/* True if w leaves to the same side of the face as of n_s. */
CRT_FN int crt_keeps_side(const CrtBsdf *b, vec3 w) {
    const f32 side = dot3(w, b->ng);
    return dot3(w, b->ns) > 0.0f ? side > 0.0f : side < 0.0f;
}

/* Of a BSDF that sends light to either side of n_s: a direction that is on the other side of the face is
   mirrored by the face. So what is refracted always crosses the face, and what is reflected never does:
   factors n² come in pairs. The direction becomes a single one, as in crt_mirror_up. */
CRT_FN CrtScatter crt_to_its_side(const CrtBsdf *b, CrtScatter s) {
    if (!(CRT_HAS(SMOOTH_NORMALS) || CRT_HAS(NORMAL_MAP)) || !s.valid || crt_keeps_side(b, s.wi)) return s;
    const int reflected = dot3(s.wi, b->ns) > 0.0f;
    s.wi = crt_mirrored(s.wi, b->ng);
    s.pdf = 0.0f;
    const f32 side = dot3(s.wi, b->ng);
    s.valid = reflected ? side > 0.0f : side < 0.0f;
    return s;
}

/* Reflection about an interpolated normal conserves what keeps light inside by total reflection: about a
   sphere's normals the distance at which light passes the centre. Light that such a normal let in elsewhere
   would never leave. So from this many scattering events on, bodies of glass have the normal of the face at
   every other vertex. */
#define CRT_FACES_FROM_DEPTH 8u

CRT_FN int crt_sees_face(const CrtContext *ctx, u32 material, u32 depth) {
    if (!(CRT_HAS(SMOOTH_NORMALS) || CRT_HAS(NORMAL_MAP))) return 0;
    if (!(CRT_HAS(DIELECTRIC) || CRT_HAS(ROUGH_DIELECTRIC))) return 0;
    if (depth < CRT_FACES_FROM_DEPTH || (depth & 1u) == 0u) return 0;
    const u32 type = CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].type;
    return type == CRT_MATERIAL_DIELECTRIC || type == CRT_MATERIAL_ROUGH_DIELECTRIC;
}

/* The normal below which nothing is sampled: of a smooth surface, before what is below it is turned up. */
CRT_FN vec3 crt_sampled_about(const CrtBsdf *b) { return CRT_HAS(SMOOTH_NORMALS) ? b->ns : b->ng; }

CRT_FN CrtScatter crt_sample_mirror_up(const CrtBsdf *b, vec4 reflectance) {
    return crt_mirror_up(b, crt_sample_mirror(reflectance, b->wo, b->ns, crt_sampled_about(b)));
}

CRT_KERNEL_END

#endif
