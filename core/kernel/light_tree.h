/*
 * light_tree.h: choosing between many lights by what they can send to the shaded point, down a binary tree
 * whose nodes bound them (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive
 * Tree Splitting"; bounds and importance as in pbrt-v4, 12.6.3). docs/decisions/0026-light-tree.md.
 */
#ifndef CRT_LIGHT_TREE_H
#define CRT_LIGHT_TREE_H

#include "light.h"

CRT_KERNEL_BEGIN

/* Rounding of the cosines below: a bound that is missed by less may be met. */
#define CRT_TREE_SLACK 1e-3f
/* What a node has at least that may send light: bounds are never taken for nothing, but for the sides of
   surfaces. */
#define CRT_TREE_LEAST_COSINE 1e-2f
/* What a child that may send light is chosen with at least: next to a brighter one rounding would leave it
   nothing. */
#define CRT_TREE_LEAST_SHARE 9.5367431640625e-7f

CRT_FN f32 crt_sine_of(f32 cosine) { return crt_sqrt(crt_max(0.0f, 1.0f - cosine * cosine)); }

/* Sine and cosine of max(a − b, 0), of angles from 0 to π. */
CRT_FN f32 crt_cosine_less(f32 sin_a, f32 cos_a, f32 sin_b, f32 cos_b) {
    return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}
CRT_FN f32 crt_sine_less(f32 sin_a, f32 cos_a, f32 sin_b, f32 cos_b) {
    return cos_a > cos_b ? 0.0f : sin_a * cos_b - cos_a * sin_b;
}

/* What the lights of a node can send to p at most, but for shadows and a factor; 0: none of them lights it.
   `n` is the normal of a surface that scatters on its side alone; of length 0: there is none such. */
CRT_FN f32 crt_light_importance(CRT_GLOBAL const CrtLightNode *node, vec3 p, vec3 n) {
    const vec3 d = crt_load3(node->centre) - p;
    const f32 distance2 = dot3(d, d);
    const f32 radius2 = node->radius * node->radius;
    /* The angle b at which the sphere is seen: within it, every direction. */
    const int outside = distance2 > radius2;
    const f32 inverse = distance2 > 0.0f ? 1.0f / crt_sqrt(distance2) : 0.0f;
    const f32 sin_b = outside ? node->radius * inverse : 0.0f;
    const f32 cos_b = outside ? crt_sqrt(crt_max(0.0f, 1.0f - sin_b * sin_b)) : -1.0f;
    const f32 towards = -dot3(crt_load3(node->axis), d) * inverse;
    const f32 cos_w = node->two_sided != 0u ? crt_abs(towards) : towards;
    const f32 sin_w = crt_sine_of(cos_w);
    /* From the axis, less the spread of the normals, less b. */
    const f32 cos_emission =
        crt_cosine_less(crt_sine_less(sin_w, cos_w, node->sin_o, node->cos_o),
                        crt_cosine_less(sin_w, cos_w, node->sin_o, node->cos_o), sin_b, cos_b);
    if (cos_emission < node->cos_e - CRT_TREE_SLACK) return 0.0f;
    const f32 nearness = outside ? inverse * inverse : 1.0f / crt_max(radius2, 1e-30f);
    const f32 importance = node->power * crt_max(cos_emission, CRT_TREE_LEAST_COSINE) * nearness;
    if (!(dot3(n, n) > 0.0f)) return importance;
    const f32 cos_i = dot3(d, n) * inverse;
    const f32 cos_receiver = crt_cosine_less(crt_sine_of(cos_i), cos_i, sin_b, cos_b);
    if (cos_receiver < -CRT_TREE_SLACK) return 0.0f;
    return importance * crt_max(cos_receiver, CRT_TREE_LEAST_COSINE);
}

CRT_FN CRT_GLOBAL const CrtLightNode *crt_light_nodes(const CrtContext *ctx) {
    const CrtSpan lights = ctx->scene->lights;
    return (CRT_GLOBAL const CrtLightNode *)(CRT_ARRAY(CrtLight, ctx->blob, lights) + lights.count);
}

CRT_FN int crt_has_light_tree(const CrtContext *ctx) {
    return CRT_HAS(LIGHT_TREE) && ctx->scene->tree_lights != 0u;
}

/* Probability of the left child of `parent`, from p; that of the right one is what is missing to 1. Below 0:
   neither of them lights p. */
CRT_FN f32 crt_light_split(CRT_GLOBAL const CrtLightNode *nodes, u32 parent, vec3 p, vec3 n) {
    const f32 left = crt_light_importance(nodes + parent + 1u, p, n);
    const f32 right = crt_light_importance(nodes + nodes[parent].right, p, n);
    const f32 sum = left + right;
    if (!(sum > 0.0f)) return -1.0f;
    if (left == 0.0f || right == 0.0f) return left > 0.0f ? 1.0f : 0.0f;
    return crt_clamp(left / sum, CRT_TREE_LEAST_SHARE, 1.0f - CRT_TREE_LEAST_SHARE);
}

/* Of the lights in the tree that one is chosen, given that the tree is. */
CRT_FN f32 crt_light_tree_probability(const CrtContext *ctx, u32 light, vec3 p, vec3 n) {
    CRT_GLOBAL const CrtLightNode *nodes = crt_light_nodes(ctx);
    u32 node = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[light].choice;
    f32 probability = 1.0f;
    while (node != 0u) {
        const u32 parent = nodes[node].parent;
        const f32 left = crt_light_split(nodes, parent, p, n);
        if (left < 0.0f) return 0.0f;
        probability = probability * (node == parent + 1u ? left : 1.0f - left);
        node = parent;
    }
    return probability;
}

/* Which light to sample; CRT_NONE: none lights p. *probability is what its own is to be multiplied by. */
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
    u32 node = 0u;
    while (nodes[node].right != 0u) {
        const f32 left = crt_light_split(nodes, node, p, n);
        if (left < 0.0f) return CRT_NONE;
        const f64 share = (f64)left;
        const int goes_left = u < share;
        u = goes_left ? u / share : (u - share) / (1.0 - share);
        *probability = *probability * (goes_left ? left : 1.0f - left);
        node = goes_left ? node + 1u : nodes[node].right;
    }
    return *probability > 0.0f ? nodes[node].light : CRT_NONE;
}

CRT_KERNEL_END

#endif
