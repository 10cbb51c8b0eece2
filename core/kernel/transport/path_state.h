/*
 * path_state.h: the state of a path between vertices, and its packing into rows of 16 bytes for schedules
 * that keep it in memory.
 *
 * CRT_PATH_STATE(VERTEX, TREE, BEGIN, FIRST) calls, for each row, one of these with (ROW, declarations,
 * lanes). It states when the row changes:
 *
 *   VERTEX  at each vertex
 *   TREE    at each vertex, in scenes with a tree of lights
 *   BEGIN   where a sample begins; crt_add_radiance and shadow rays add to its radiance
 *   FIRST   at the first vertex, in scenes with AOVs
 *
 * `declarations` are the members of CrtPath that the row holds, or begins to hold. `lanes` says which
 * members lie in the four lanes of the row: V4 is one vec4; V3 a vec3 and another lane; F4 four lanes; F1
 * one lane. A lane is an F32 or U32 member, WORD (crt_path_word), NUMBERS (the state of the sampler) or
 * UNUSED.
 */
#ifndef CRT_PATH_STATE_H
#define CRT_PATH_STATE_H

#include "kernel/film/film.h"
#include "kernel/geometry/ray.h"
#include "kernel/lights/environment_image.h"

CRT_KERNEL_BEGIN

/*
 *   depth           scattering events so far
 *   panes           that the path has passed, up to CRT_PANES_COUNTED
 *   hero            1 in the lane of the hero wavelength, 0 elsewhere
 *   hero_only       only the hero wavelength is alive
 *   p               where the path was scattered: a clearance off the ray's origin
 *   scatter_pdf     of the direction that led here; 0: camera or delta, no light sampling competes
 *   scatter_cosine  crt_scatter_cosine of that direction, where scatter_pdf is above 0
 *   eta_square      product of squared relative indices crossed: roulette must not see the n² of being
 *                   inside glass
 *   media           around the ray where it begins (medium.h)
 *   side            crt_scattering_side (vertex.h) of the vertex at p
 */
#define CRT_PATH_STATE(VERTEX, TREE, BEGIN, FIRST)                                              \
    VERTEX(ORIGIN, CrtRay ray; u32 depth; u32 panes; vec4 hero; int hero_only;, V3(ray.o, WORD))    \
    VERTEX(DIRECTION, CrtSampler sampler;, V3(ray.d, NUMBERS))                                  \
    VERTEX(THROUGHPUT, vec4 throughput;, V4(throughput))                                        \
    BEGIN(RADIANCE, vec4 radiance;, V4(radiance))                                               \
    BEGIN(WAVELENGTHS, CrtWavelengths wavelengths;, V4(wavelengths.position))                   \
    VERTEX(POINT, vec3 p; f32 scatter_pdf;, V3(p, F32(scatter_pdf)))                            \
    VERTEX(REST, f32 scatter_cosine; f32 eta_square; u32 media;,                                \
           F4(F32(scatter_cosine), F32(eta_square), F32(wavelengths.u), U32(media)))            \
    TREE(SIDE, vec3 side;, V3(side, UNUSED))                                                    \
    FIRST(ALBEDO, CrtFirstHit first;, V4(first.albedo))                                         \
    FIRST(NORMAL, , V3(first.normal, F32(first.depth)))                                         \
    FIRST(PRIMITIVE, , F1(U32(first.primitive)))

#define CRT_PATH_MEMBERS(ROW, DECLARATIONS, LANES) DECLARATIONS
typedef struct CrtPath {
    CRT_PATH_STATE(CRT_PATH_MEMBERS, CRT_PATH_MEMBERS, CRT_PATH_MEMBERS, CRT_PATH_MEMBERS)
    u32 met; /* material that the ray has found a mix to be of (passing.h); or CRT_NONE */
    CRT_GLOBAL vec4 *radiance_row; /* holds the radiance while a wave shades the path; or null */
    /* Where paths take turns: the ray has met nothing, and the texel of the environment there is fetched. */
    int leaves;
    CrtEnvironmentPlace place;
} CrtPath;

/* Adds radiance that the path has found. A wave adds it to memory: registers are scarcest while it shades,
   and most vertices add nothing. */
CRT_FN void crt_add_radiance(CrtPath *path, vec4 found) {
    if (path->radiance_row != 0) *path->radiance_row = *path->radiance_row + found;
    else path->radiance = path->radiance + found;
}

CRT_FN vec4 crt_hero_lane(u32 lane) {
    return make_vec4(lane == 0u ? 1.0f : 0.0f, lane == 1u ? 1.0f : 0.0f, lane == 2u ? 1.0f : 0.0f,
                     lane == 3u ? 1.0f : 0.0f);
}

#define CRT_PANES_COUNTED 7u
#define CRT_PANES_SHIFT 26u /* in the word: above CRT_MOST_EVENTS */

CRT_FN u32 crt_count_panes(u32 before, u32 more) {
    return before + more < CRT_PANES_COUNTED ? before + more : CRT_PANES_COUNTED;
}

/* Depth, panes, hero wavelength and `hero_only` in one word. */
CRT_FN u32 crt_path_word(const CrtPath *path) {
    u32 word = path->depth | path->panes << CRT_PANES_SHIFT | (path->hero_only ? 0x80000000u : 0u);
    if (CRT_HAS(DISPERSION))
        word |= (u32)(V4Y(path->hero) + 2.0f * V4Z(path->hero) + 3.0f * V4W(path->hero)) << 29;
    return word;
}
CRT_FN u32 crt_depth_of_word(u32 word) { return word & CRT_MOST_EVENTS; }
CRT_FN u32 crt_panes_of_word(u32 word) { return word >> CRT_PANES_SHIFT & CRT_PANES_COUNTED; }
CRT_FN u32 crt_word_behind_panes(u32 word, u32 panes) {
    const u32 before = crt_panes_of_word(word);
    return word + ((crt_count_panes(before, panes) - before) << CRT_PANES_SHIFT);
}
CRT_FN void crt_set_path_word(CrtPath *path, u32 word) {
    path->depth = crt_depth_of_word(word);
    path->panes = crt_panes_of_word(word);
    path->hero = crt_hero_lane(CRT_HAS(DISPERSION) ? word >> 29 & 3u : 0u);
    path->hero_only = word >> 31 != 0u;
}

CRT_KERNEL_END

#endif
