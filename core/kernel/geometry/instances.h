/*
 * instances.h: meshes that are stored once and placed many times. A ray goes to the boxes of the mesh in
 * the mesh's coordinates; a triangle goes to the ray in the scene's: its corners are rounded once, in a
 * stated order, and the one triangle test decides, as of every other triangle. So hits are the same bits on
 * every backend, neighbours share their corners, and all that holds for triangles (offsets, watertight
 * edges) holds for these. They differ from those of the flattened scene by the rounding of corners alone.
 */
#ifndef CRT_INSTANCES_H
#define CRT_INSTANCES_H

#include "kernel/geometry/boxes.h"
#include "kernel/geometry/shadow_ray.h"

CRT_KERNEL_BEGIN

CRT_FN CRT_GLOBAL const CrtInstance *crt_instance(const CrtContext *ctx, u32 index) {
    return CRT_ARRAY(CrtInstance, ctx->blob, ctx->scene->instances) + index;
}

/* One coordinate in the scene of a point of the mesh. */
CRT_FN f32 crt_place(CRT_GLOBAL const f32 *row, f32 x, f32 y, f32 z) {
    return crt_fma(row[0], x, crt_fma(row[1], y, crt_fma(row[2], z, row[3])));
}

/* That of the three corners of a triangle. */
CRT_FN vec3 crt_place_corners(CRT_GLOBAL const f32 *row, CRT_GLOBAL const CrtTriangle *triangle) {
    CRT_GLOBAL const f32 *p = triangle->p;
    return make_vec3(crt_place(row, p[0], p[3], p[6]), crt_place(row, p[1], p[4], p[7]),
                     crt_place(row, p[2], p[5], p[8]));
}

/* A direction of the scene in the mesh: without the translation. */
CRT_FN vec3 crt_direction_to_mesh(CRT_GLOBAL const CrtInstance *instance, vec3 d) {
    CRT_GLOBAL const f32 *m = instance->to_mesh;
    return make_vec3(crt_fma(m[0], V3X(d), crt_fma(m[1], V3Y(d), m[2] * V3Z(d))),
                     crt_fma(m[4], V3X(d), crt_fma(m[5], V3Y(d), m[6] * V3Z(d))),
                     crt_fma(m[8], V3X(d), crt_fma(m[9], V3Y(d), m[10] * V3Z(d))));
}

/* A ray among the boxes of a mesh. */
CRT_FN CrtNodeRay crt_mesh_ray(CRT_GLOBAL const CrtInstance *instance, CrtRay ray) {
    CRT_GLOBAL const f32 *m = instance->to_mesh;
    const f32 x = V3X(ray.o), y = V3Y(ray.o), z = V3Z(ray.o);
    const vec3 o = make_vec3(crt_place(m, x, y, z), crt_place(m + 4, x, y, z), crt_place(m + 8, x, y, z));
    const f32 slack =
        crt_fma(instance->slack_per_length, crt_abs(x) + crt_abs(y) + crt_abs(z), instance->slack);
    CrtRay moved = ray;
    moved.o = o;
    moved.d = crt_direction_to_mesh(instance, ray.d);
    return crt_node_ray(moved, slack);
}

/* crt_intersect_triangle of a triangle of an instance. */
CRT_FN int crt_intersect_placed(CRT_GLOBAL const CrtInstance *instance,
                                CRT_GLOBAL const CrtTriangle *triangle,
                                CrtShear shear, f32 limit, CrtHit *hit) {
    return crt_intersect_corners(crt_place_corners(instance->to_world + 4u * shear.kx, triangle),
                                 crt_place_corners(instance->to_world + 4u * shear.ky, triangle),
                                 crt_place_corners(instance->to_world + 4u * shear.kz, triangle), shear,
                                 limit, hit);
}

/* Tests a triangle of an instance against the best hit so far. */
CRT_FN void crt_test_placed(CRT_GLOBAL const CrtInstance *instance, u32 index,
                            CRT_GLOBAL const CrtTriangle *triangles, u32 slot, CrtShear shear,
                            CrtHit *best) {
    CRT_GLOBAL const CrtTriangle *triangle = triangles + slot;
    CrtHit hit;
    if (!crt_intersect_placed(instance, triangle, shear, crt_tie_limit(best->t), &hit)) return;
    const u32 id = instance->first_id + (triangle->id - instance->first_primitive);
    crt_keep_nearer(hit.t, hit.b1, hit.b2, slot, id, index + 1u, best);
}

/* The triangles of an instance against the best hit so far: bvh.h's traversal, in the mesh's coordinates. */
CRT_FN void crt_instance_closest(const CrtContext *ctx, u32 index, CrtRay ray, CrtShear shear,
                                 CrtHit *best) {
    CRT_GLOBAL const CrtInstance *instance = crt_instance(ctx, index);
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->mesh_nodes);
    const CrtNodeRay mesh = crt_mesh_ray(instance, ray);
    u64 stack[CRT_BVH_STACK];
    u32 size = 0u;
    u32 current = instance->root << 4;
#if CRT_SIMD8
    for (;;) {
        const u32 count = current & 15u;
        if (count == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, mesh, best->t);
            if (crt_enter_nearest(node, t, stack, &size, &current)) continue;
        } else {
            const u32 first = current >> 4;
            for (u32 i = 0u; i < count; ++i)
                crt_test_placed(instance, index, triangles, first + i, shear, best);
        }
        if (!crt_next_stacked(stack, &size, best->t, &current)) return;
    }
#else /* two loops, as in bvh.h */
    for (;;) {
        while ((current & 15u) == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, mesh, best->t);
            if (crt_enter_nearest(node, t, stack, &size, &current)) continue;
            if (!crt_next_stacked(stack, &size, best->t, &current)) return;
        }
        const u32 first = current >> 4, end = first + (current & 15u);
        for (u32 slot = first; slot < end; ++slot)
            crt_test_placed(instance, index, triangles, slot, shear, best);
        if (!crt_next_stacked(stack, &size, best->t, &current)) return;
    }
#endif
}

/* Returns 1 if a triangle of an instance stops a shadow ray. */
CRT_FN int crt_placed_stops(const CrtContext *ctx, CRT_GLOBAL const CrtInstance *instance, u32 index,
                            CRT_GLOBAL const CrtTriangle *triangles, u32 slot, CrtShear shear, f32 reach,
                            CrtPassable *passable) {
    CRT_GLOBAL const CrtTriangle *triangle = triangles + slot;
    CrtHit hit;
    if (!crt_intersect_placed(instance, triangle, shear, reach, &hit)) return 0;
    hit.slot = slot;
    hit.id = instance->first_id + (triangle->id - instance->first_primitive);
    hit.instance = index + 1u;
    return crt_stops(ctx, hit, 1u, passable);
}

CRT_FN int crt_instance_any(const CrtContext *ctx, u32 index, CrtRay ray, CrtShear shear,
                            CrtPassable *passable) {
    CRT_GLOBAL const CrtInstance *instance = crt_instance(ctx, index);
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->mesh_nodes);
    const CrtNodeRay mesh = crt_mesh_ray(instance, ray);
    u32 stack[CRT_BVH_STACK];
#if CRT_SIMD8
    u32 size = 0u;
    u32 current = instance->root << 4;
    for (;;) {
        const u32 count = current & 15u;
        if (count == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, mesh, ray.reach);
            if (crt_enter_any(node, t, stack, &size, &current)) continue;
        } else {
            const u32 first = current >> 4;
            for (u32 i = 0u; i < count; ++i)
                if (crt_placed_stops(ctx, instance, index, triangles, first + i, shear, ray.reach, passable))
                    return 1;
        }
        if (size == 0u) return 0;
        --size;
        current = stack[size];
    }
#else
    u32 size = 0u;
    u32 current = instance->root << 4;
    for (;;) {
        while ((current & 15u) == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, mesh, ray.reach);
            if (crt_enter_any(node, t, stack, &size, &current)) continue;
            if (size == 0u) return 0;
            --size;
            current = stack[size];
        }
        const u32 first = current >> 4, end = first + (current & 15u);
        for (u32 slot = first; slot < end; ++slot)
            if (crt_placed_stops(ctx, instance, index, triangles, slot, shear, ray.reach, passable))
                return 1;
        if (size == 0u) return 0;
        --size;
        current = stack[size];
    }
#endif
}

CRT_KERNEL_END

#endif
