/*
 * light_tree.h: choosing between many lights by what they can send to the shaded point, down a tree whose
 * nodes bound them, four children each (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights
 * with Adaptive Tree Splitting"; bounds and importance as in pbrt-v4, 12.6.3).
 * docs/decisions/0026-light-tree.md.
 */
#ifndef CRT_LIGHT_TREE_H
#define CRT_LIGHT_TREE_H

#include "kernel/lights/light.h"

CRT_KERNEL_BEGIN

/* Rounding of the cosines below: a bound that is missed by less may be met. */
#define CRT_TREE_SLACK 1e-3f
/* The least cosine that a node counts with if it may send light: its bounds never make it 0, except for the
   sides of surfaces. */
#define CRT_TREE_LEAST_COSINE 1e-2f
/* The least share of the choice for a child that may send light: next to a brighter one rounding could make
   it 0. */
#define CRT_TREE_LEAST_SHARE 9.5367431640625e-7f

CRT_FN vec4 crt_sines_of(vec4 cosines) {
    return crt_sqrt4(crt_max4(splat4(1.0f) - cosines * cosines, splat4(0.0f)));
}

CRT_FN vec4 crt_dots(vec4 x, vec4 y, vec4 z, vec4 u, vec4 v, vec4 w) {
    return crt_fma4(x, u, crt_fma4(y, v, z * w));
}

/* Upper bounds of the light that the lights of each child of a node send to p, without shadows and up to a
   factor; 0: none of them lights p. `n` is the normal of a surface that scatters on that side alone; its
   length is 0 where there is no such surface. */
CRT_FN vec4 crt_light_importances(CRT_GLOBAL const CrtLightNode *node, vec3 p, vec3 n) {
    const vec4 zero = splat4(0.0f), one = splat4(1.0f);
    const vec4 dx = crt_load4(node->centre_x) - splat4(V3X(p)),
               dy = crt_load4(node->centre_y) - splat4(V3Y(p)),
               dz = crt_load4(node->centre_z) - splat4(V3Z(p)), radius = crt_load4(node->radius);
    const vec4 distance2 = crt_dots(dx, dy, dz, dx, dy, dz), radius2 = radius * radius;
    /* From within the sphere, as from its edge. */
    const vec4 inverse = one / crt_sqrt4(crt_max4(crt_max4(distance2, radius2), splat4(1e-30f)));
    /* The angle b at which the sphere is seen; x: of its normals, too. Within it, every direction. */
    const vec4 sin_b = radius * inverse, cos_b = crt_sines_of(sin_b);
    const vec4 cos_o = crt_load4(node->cos_o), sin_o = crt_load4(node->sin_o);
    const vec4 sin_x = crt_fma4(sin_o, cos_b, cos_o * sin_b), cos_x = cos_o * cos_b - sin_o * sin_b;
    const vec4 whole = splat4(-1.0f);
    const vec4 below_pi = crt_where_less4(radius2, distance2, sin_x, whole);
    const vec4 bound_x = crt_where_less4(below_pi, zero, whole, cos_x);
    /* From the axis w, less x. */
    const vec4 towards = crt_dots(dx, dy, dz, crt_load4(node->axis_x), crt_load4(node->axis_y),
                                  crt_load4(node->axis_z)) * (inverse * -1.0f);
    const vec4 cos_w = crt_max4(towards, towards * crt_load4(node->back));
    const vec4 cos_emission =
        crt_where_less4(cos_w, bound_x, crt_fma4(cos_w, cos_x, crt_sines_of(cos_w) * sin_x), one);
    const vec4 sent = crt_load4(node->power) * crt_max4(cos_emission, splat4(CRT_TREE_LEAST_COSINE)) *
                      (inverse * inverse);
    const vec4 importance =
        crt_where_less4(cos_emission, crt_load4(node->cos_e) - splat4(CRT_TREE_SLACK), zero, sent);
    if (!(dot3(n, n) > 0.0f)) return importance;
    const vec4 cos_i = crt_dots(dx, dy, dz, splat4(V3X(n)), splat4(V3Y(n)), splat4(V3Z(n))) * inverse;
    const vec4 bound_b = crt_where_less4(radius2, distance2, cos_b, whole);
    const vec4 cos_receiver =
        crt_where_less4(cos_i, bound_b, crt_fma4(cos_i, cos_b, crt_sines_of(cos_i) * sin_b), one);
    return crt_where_less4(cos_receiver, splat4(-CRT_TREE_SLACK), zero,
                           importance * crt_max4(cos_receiver, splat4(CRT_TREE_LEAST_COSINE)));
}

/* The children of a node are chosen in proportion to these values. Their sum is 0 where none of them lights
   p. */
CRT_FN vec4 crt_light_shares(CRT_GLOBAL const CrtLightNode *node, vec3 p, vec3 n) {
    const vec4 importance = crt_light_importances(node, p, n);
    const vec4 least = splat4(sum4(importance) * CRT_TREE_LEAST_SHARE);
    return crt_where_less4(splat4(0.0f), importance, crt_max4(importance, least), splat4(0.0f));
}

CRT_FN CRT_GLOBAL const CrtLightNode *crt_light_nodes(const CrtContext *ctx) {
    const CrtSpan lights = ctx->scene->lights;
    return (CRT_GLOBAL const CrtLightNode *)(CRT_ARRAY(CrtLight, ctx->blob, lights) + lights.count);
}

CRT_FN int crt_has_light_tree(const CrtContext *ctx) {
    return CRT_HAS(LIGHT_TREE) && ctx->scene->tree_lights != 0u;
}

/* The probability of one of the tree's lights, given that the tree is chosen. */
CRT_FN f32 crt_light_tree_probability(const CrtContext *ctx, u32 light, vec3 p, vec3 n) {
    CRT_GLOBAL const CrtLightNode *nodes = crt_light_nodes(ctx);
    u32 at = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[light].choice;
    f32 probability = 1.0f;
    for (;;) {
        const u32 node = at >> 2;
        const vec4 shares = crt_light_shares(nodes + node, p, n);
        const f32 share = crt_lane(shares, at & 3u);
        if (!(share > 0.0f)) return 0.0f;
        probability = probability * (share / sum4(shares));
        if (node == 0u) return probability;
        at = nodes[node].parent;
    }
}

/* Chooses a light to sample; CRT_NONE: none lights p. *probability is the factor of the light's own
   probability. */
CRT_FN u32 crt_light_tree_choose(const CrtContext *ctx, CrtSampler *sampler, u32 dimension, vec3 p, vec3 n,
                                 f32 *probability) {
    CRT_GLOBAL const CrtLight *lights = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights);
    CRT_GLOBAL const CrtLightNode *nodes = crt_light_nodes(ctx);
    const u32 others = ctx->scene->tree_lights;
    const u32 choice = crt_sample_bits(sampler, dimension + CRT_DIM_LIGHT_CHOICE);
    *probability = 1.0f;
    f64 end = 4294967296.0;
    if (others < ctx->scene->lights.count) {
        if (lights[others].choice <= choice)
            return crt_light_search(lights, others, ctx->scene->lights.count, choice);
        end = (f64)lights[others].choice;
    }
    /* Digits below those of the sampler's, which a tree of many lights would use up. */
    f64 u = ((f64)choice + (f64)crt_hash(choice) * 2.3283064365386963e-10) / end;
    u32 child = 0u;
    do {
        const vec4 shares = crt_light_shares(nodes + child, p, n);
        /* Exact: the least is a millionth of the sum. */
        const f64 first = (f64)V4X(shares), second = first + (f64)V4Y(shares),
                  third = second + (f64)V4Z(shares), all = third + (f64)V4W(shares);
        if (!(all > 0.0)) return CRT_NONE;
        /* Less than `all`, even rounded, so that a child without a share is never chosen. */
        const f64 last = all * 0.9999999999999998;
        const f64 place = u * all < last ? u * all : last;
        const u32 lane =
            (place >= first ? 1u : 0u) + (place >= second ? 1u : 0u) + (place >= third ? 1u : 0u);
        const f64 before = lane == 0u ? 0.0 : (lane == 1u ? first : (lane == 2u ? second : third));
        const f32 share = crt_lane(shares, lane);
        u = (place - before) / (f64)share;
        *probability = *probability * (share / sum4(shares));
        child = nodes[child].child[lane];
    } while (child < CRT_LIGHT_LEAF);
    return child - CRT_LIGHT_LEAF;
}

CRT_KERNEL_END

#endif
