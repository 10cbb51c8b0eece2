/*
 * hit.h: the hit of a ray. intersect.h and the headers that include it find hits; the headers of values and
 * materials need none of those.
 */
#ifndef CRT_HIT_H
#define CRT_HIT_H

#include "kernel/dialect/context.h"
#include "kernel/dialect/math.h"

CRT_KERNEL_BEGIN

typedef struct CrtHit {
    f32 t;       /* in lengths of the ray's direction */
    f32 b1, b2;  /* barycentrics of the second and third vertex */
    u32 slot;    /* in the triangle array; CRT_NONE: nothing hit */
    u32 id;      /* primitive id; only where something was hit */
    u32 instance; /* 1 + the index of its CrtInstance; 0: none. Only where there are some */
} CrtHit;

/* No hit yet. Of equally near hits the lower id wins (crt_keep_nearer), and none is lower than this one's:
   what lies at `reach` itself is no hit, as for crt_trace_any. */
CRT_FN CrtHit crt_no_hit(f32 reach) {
    CrtHit hit;
    hit.t = reach;
    hit.b1 = hit.b2 = 0.0f;
    hit.slot = CRT_NONE;
    hit.id = 0u;
    hit.instance = 0u;
    return hit;
}

/* The primitive id of what a slot holds, if `instance` (as of CrtHit) has it. */
CRT_FN u32 crt_id_of(const CrtContext *ctx, u32 slot, u32 instance) {
    const u32 id = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles)[slot].id;
    if (!CRT_HAS(INSTANCES) || instance == 0u) return id;
    CRT_GLOBAL const CrtInstance *of =
        CRT_ARRAY(CrtInstance, ctx->blob, ctx->scene->instances) + (instance - 1u);
    return of->first_id + (id - of->first_primitive);
}

/* The number of the primitive that was hit, of an instance that of its mesh. */
CRT_FN u32 crt_primitive_of(const CrtContext *ctx, CrtHit hit) {
    if (CRT_HAS(INSTANCES) && hit.instance != 0u)
        return CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles)[hit.slot].id;
    return hit.id;
}

/* The compositions of materials, by number of the material; only where scene.compositions has some. */
CRT_FN CRT_GLOBAL const CrtComposition *crt_compositions(const CrtContext *ctx) {
    return CRT_ARRAY(CrtComposition, ctx->blob, ctx->scene->compositions);
}

/* The coordinates of a point on a triangle or a shape, for texture look-ups. */
typedef struct CrtFacePlace {
    u32 id;     /* number of the primitive, of an instance that of its mesh; for tangents, too */
    f32 b1, b2; /* barycentrics of the second and third vertex; triangles alone */
    f32 u, v;   /* texture coordinates; 0 where the mesh has none */
} CrtFacePlace;

/* A hit as materials and lights read it. crt_surface fills it (surface.h). */
typedef struct CrtSurface {
    vec3 p;
    vec3 ng;       /* unit geometric normal, by the order of the vertices, or of the shape */
    vec3 ns;       /* unit shading normal, on the side of ng */
    f32 clearance; /* how far along ng a ray must start from p to be sure of its side */
    u32 material;
    u32 light;     /* CRT_NONE: it does not emit */
    u32 medium;    /* of what it bounds, as of CrtMaterial; for media only */
    int touches;   /* another body's surface lies in the same place; for media only */
    u32 slot;      /* in the triangle array; for tangents only */
    u32 instance;  /* as of CrtHit; for tangents only */
    CrtFacePlace at; /* of p; for tangents and textures only */
} CrtSurface;

CRT_KERNEL_END

#endif
