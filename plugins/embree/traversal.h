/// Rays through a Tree, eight boxes or triangles at a time. Boxes cull, conservatively, as those of
/// kernel/geometry/boxes.h do; triangles are tested by the operations of crt_intersect_corners, each in a
/// separate lane, so that hits are the same bits as on every other backend.
#pragma once

#include "tile_job.h"

#include <immintrin.h>

namespace crt::embree {

using namespace kernel;

// Each kernel's own: they hold what its mask has. The linker would keep those of one kernel for all.
namespace {

inline vec8 cullMax(vec8 a, vec8 b) { return (vec8)_mm256_max_ps((__m256)a, (__m256)b); }

/// Bits of the children that the ray enters at most `limit` away, and where: crt_node_distances.
inline u32 entered(const Node8& node, const CrtNodeRay& ray, f32 limit, vec8* enter) {
    const f32* planes = &node.bounds[0][0];
    const vec8 ix = splat8(ray.inverse.x), iy = splat8(ray.inverse.y), iz = splat8(ray.inverse.z);
    const auto at = [&](u32 plane, vec8 inverse, f32 moved) {
        return crt_fma8(crt_load8(planes + 8 * plane), inverse, splat8(moved));
    };
    *enter = cullMax(
        at(ray.near_z, iz, ray.near.z),
        cullMax(at(ray.near_y, iy, ray.near.y), cullMax(at(ray.near_x, ix, ray.near.x), splat8(0.0f))));
    const vec8 leave =
        crt_min8(at(ray.near_z ^ 1u, iz, ray.far.z),
                 crt_min8(at(ray.near_y ^ 1u, iy, ray.far.y),
                          crt_min8(at(ray.near_x ^ 1u, ix, ray.far.x), splat8(limit * CRT_SLAB_SLACK))));
    return mask8_bits(*enter <= leave);
}

inline vec8 differenceOfProducts(vec8 a, vec8 b, vec8 c, vec8 d) {
    const vec8 cd = c * d;
    const vec8 error = crt_fma8(-c, d, cd);
    return crt_fma8(a, b, -cd) + error;
}

struct alignas(32) Hits8 {
    f32 t[8], b1[8], b2[8];
};

/// crt_intersect_corners for the triangles of a leaf. Bits of those that are hit; `hits` is filled where
/// there are some.
inline u32 hitsOf(const Leaf8& leaf, const CrtShear& ray, f32 limit, Hits8* hits) {
    const f32(*px)[8] = leaf.p + 3 * ray.kx, (*py)[8] = leaf.p + 3 * ray.ky, (*pz)[8] = leaf.p + 3 * ray.kz;
    const vec8 ox = splat8(ray.ox), oy = splat8(ray.oy), oz = splat8(ray.oz);
    const vec8 sx = splat8(-ray.sx), sy = splat8(-ray.sy);
    const vec8 az = crt_load8(pz[0]) - oz;
    const vec8 bz = crt_load8(pz[1]) - oz;
    const vec8 cz = crt_load8(pz[2]) - oz;
    const vec8 ax = crt_fma8(sx, az, crt_load8(px[0]) - ox);
    const vec8 bx = crt_fma8(sx, bz, crt_load8(px[1]) - ox);
    const vec8 cx = crt_fma8(sx, cz, crt_load8(px[2]) - ox);
    const vec8 ay = crt_fma8(sy, az, crt_load8(py[0]) - oy);
    const vec8 by = crt_fma8(sy, bz, crt_load8(py[1]) - oy);
    const vec8 cy = crt_fma8(sy, cz, crt_load8(py[2]) - oy);
    const vec8 u = differenceOfProducts(cx, by, cy, bx);
    const vec8 v = differenceOfProducts(ax, cy, ay, cx);
    const vec8 w = differenceOfProducts(bx, ay, by, ax);
    const vec8 zero = splat8(0.0f);
    const mask8 outside = ((u < zero) | (v < zero) | (w < zero)) & ((u > zero) | (v > zero) | (w > zero));
    const vec8 det = u + v + w;
    // Where there is no triangle it is NaN, neither below 0 nor above.
    const mask8 met = ~outside & ((det < zero) | (det > zero));
    if (mask8_bits(met) == 0u) return 0u;
    const vec8 inverse_det = splat8(1.0f) / det;
    const vec8 t = crt_fma8(u, az, crt_fma8(v, bz, w * cz)) * splat8(ray.sz) * inverse_det;
    const u32 lanes = mask8_bits(met & (t > zero) & (t < splat8(limit)));
    if (lanes == 0u) return 0u;
    _mm256_store_ps(hits->t, (__m256)t);
    _mm256_store_ps(hits->b1, (__m256)(v * inverse_det));
    _mm256_store_ps(hits->b2, (__m256)(w * inverse_det));
    return lanes;
}

/// A node to visit, and the distance at which the ray enters it.
struct Stacked {
    Child child;
    f32 enter;
};
/// Of each level all children but the one that is visited.
inline constexpr u32 kStack = 7 * kMostLevels + 1;

/// Of the children in `met`, at least one, the nearest is returned; the others go onto the stack, the
/// farthest first.
inline Child nearestOf(const Node8& node, u32 met, vec8 enter, Stacked* stack, u32* size) {
    const u32 first = crt_lowest_bit(met);
    met &= met - 1u;
    if (met == 0u) return node.child[first];
    alignas(32) f32 at[8];
    _mm256_store_ps(at, (__m256)enter);
    const u32 begin = *size;
    stack[(*size)++] = {node.child[first], at[first]};
    for (; met != 0u; met &= met - 1u) {
        const u32 i = crt_lowest_bit(met);
        u32 place = (*size)++;
        for (; place > begin && stack[place - 1].enter < at[i]; --place) stack[place] = stack[place - 1];
        stack[place] = {node.child[i], at[i]};
    }
    return stack[--*size].child;
}

inline const Leaf8& leafOf(Child child) { return *reinterpret_cast<const Leaf8*>(child & ~kMarks); }
inline u32 slotOf(Child child) { return static_cast<u32>(child >> kSlotShift); }

inline void testLeaf(const Leaf8& leaf, const CrtTriangle* triangles, const CrtShear& shear, CrtHit* best) {
    Hits8 hits;
    for (u32 lanes = hitsOf(leaf, shear, crt_tie_limit(best->t), &hits); lanes != 0u; lanes &= lanes - 1u) {
        const u32 i = crt_lowest_bit(lanes), slot = leaf.slot[i];
        if (hits.t[i] < crt_tie_limit(best->t))
            crt_keep_nearer(hits.t[i], hits.b1[i], hits.b2[i], slot, triangles[slot].id, 0u, best);
    }
}

inline CrtHit closestHit(const CrtContext* ctx, const CrtRay& ray) {
    const CrtTriangle* triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CrtHit best = crt_no_hit(ray.reach);
    if (!crt_is_ray(ray)) return best;
    const CrtShear shear = crt_shear(ray);
    const CrtNodeRay among = crt_node_ray(ray, 0.0f);
    Stacked stack[kStack];
    u32 size = 0u;
    Child current = ctx->tree;
    for (;;) {
        if ((current & kMarks) == 0) {
            const Node8& node = *reinterpret_cast<const Node8*>(current);
            vec8 enter;
            if (const u32 met = entered(node, among, best.t, &enter)) {
                current = nearestOf(node, met, enter, stack, &size);
                continue;
            }
        } else if (!CRT_HAS_SLOTS || (current & kLeaf) != 0) {
            testLeaf(leafOf(current), triangles, shear, &best);
        } else {
            crt_test_slot(ctx, triangles, slotOf(current), ray, shear, &best);
        }
        do {
            if (size == 0u) return best;
            --size;
        } while (stack[size].enter > best.t * CRT_SLAB_SLACK);
        current = stack[size].child;
    }
}

/// Returns true if a triangle of the leaf stops the shadow ray.
inline bool leafStops(const CrtContext* ctx, const Leaf8& leaf, const CrtTriangle* triangles,
                      const CrtShear& shear, f32 reach, CrtPassable* passable) {
    Hits8 hits;
    u32 lanes = hitsOf(leaf, shear, reach, &hits);
    if (!crt_has_panes(ctx)) return lanes != 0u;
    for (; lanes != 0u; lanes &= lanes - 1u) {
        const u32 i = crt_lowest_bit(lanes), slot = leaf.slot[i];
        const CrtHit hit{hits.t[i], hits.b1[i], hits.b2[i], slot, triangles[slot].id, 0u};
        if (crt_stops(ctx, hit, 1u, passable)) return true;
    }
    return false;
}

inline bool anyHit(const CrtContext* ctx, const CrtRay& ray, CrtPassable* passable) {
    const CrtTriangle* triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    if (!crt_is_ray(ray)) return false;
    const CrtShear shear = crt_shear(ray);
    const CrtNodeRay among = crt_node_ray(ray, 0.0f);
    Child stack[kStack];
    u32 size = 1u;
    stack[0] = ctx->tree;
    while (size != 0u) {
        const Child current = stack[--size];
        if ((current & kMarks) == 0) {
            const Node8& node = *reinterpret_cast<const Node8*>(current);
            vec8 enter;
            for (u32 met = entered(node, among, ray.reach, &enter); met != 0u; met &= met - 1u)
                stack[size++] = node.child[crt_lowest_bit(met)];
        } else if (!CRT_HAS_SLOTS || (current & kLeaf) != 0) {
            if (leafStops(ctx, leafOf(current), triangles, shear, ray.reach, passable)) return true;
        } else if (crt_slot_stops(ctx, triangles, slotOf(current), ray, shear, passable)) {
            return true;
        }
    }
    return false;
}

}  // namespace
}  // namespace crt::embree
