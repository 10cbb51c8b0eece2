/*
 * shade.h: what happens to a path at a vertex: emission that it meets (emission.h), a shadow ray of light
 * sampling (direct_light.h), and the direction in which it goes on (continuation.h). Nothing here traces a
 * ray, so that each backend chooses how it traces.
 */
#ifndef CRT_SHADE_H
#define CRT_SHADE_H

#include "kernel/camera/camera.h"
#include "kernel/materials/composition.h"
#include "kernel/transport/continuation.h"
#include "kernel/transport/emission.h"

CRT_KERNEL_BEGIN

/* Written in place: a path that is returned is copied in wide words, which wait for its narrow stores. */
CRT_FN void crt_path_begin(const CrtContext *ctx, CrtPath *path, u32 x, u32 y, u64 sample) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const u32 pixel_x = scene->crop_x + x;
    const u32 pixel_y = scene->crop_y + y;
    path->sampler = crt_sampler_begin(scene->sampler, scene->replicate_shift, scene->seed,
                                      pixel_y * scene->film_width + pixel_x, sample);
    path->ray = crt_camera_ray(ctx, &path->sampler, pixel_x, pixel_y);
    path->wavelengths = crt_sample_wavelengths(ctx, crt_sample_1d(&path->sampler, CRT_DIM_WAVELENGTH));
    path->hero = make_vec4(1.0f, 0.0f, 0.0f, 0.0f);
    if (CRT_SCENE_HAS(scene, DISPERSION))
        path->hero = crt_hero_lane(crt_sample_bits(&path->sampler, CRT_DIM_HERO) >> 30);
    path->throughput = splat4(1.0f);
    path->radiance = splat4(0.0f);
    path->radiance_row = 0;
    path->scatter_pdf = 0.0f;
    path->scatter_cosine = 0.0f;
    path->p = path->ray.o;
    if (CRT_HAS(LIGHT_TREE)) path->side = make_vec3(0.0f, 0.0f, 0.0f);
    path->eta_square = 1.0f;
    path->depth = 0u;
    path->panes = 0u;
    path->hero_only = 0;
    path->met = CRT_NONE;
    if (CRT_TAKES_TURNS && crt_has_environment_image(ctx)) path->leaves = 0;
    path->media = CRT_HAS(MEDIA) ? scene->camera_media : 0u;
    path->first.albedo = splat4(0.0f);
    path->first.normal = make_vec3(0.0f, 0.0f, 0.0f);
    path->first.depth = 0.0f;
    path->first.primitive = CRT_NONE;
}

/* Absorbs the path's throughput on the way to `surface`, or, with none, out of the scene. */
CRT_FN void crt_absorb(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface) {
    /* From where it was scattered: the ray began a clearance off. */
    const f32 distance = surface != 0 ? length3(surface->p - path->p) : CRT_INFINITY;
    const u32 medium = surface != 0 ? crt_medium_before(ctx, surface, path->ray.d, path->media)
                                    : crt_first_medium(ctx, path->media);
    path->throughput =
        path->throughput * crt_transmittance(ctx, medium, distance, path->wavelengths.position);
}

/* Shades a path at `hit`, which its ray has met: adds the emission there, samples the lights, and scatters
   the path. Returns 0 when it has ended. Traces nothing: path->ray is the next ray, and *shadow may be
   pending, whether or not the path goes on. */
CRT_FN int crt_shade(const CrtContext *ctx, CrtPath *path, CrtHit hit, CrtShadow *shadow) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    shadow->pending = 0;
    if (hit.slot == CRT_NONE) {
        if (CRT_HAS(MEDIA)) crt_absorb(ctx, path, 0);
        return crt_leave(ctx, path);
    }
    const u32 dimension = crt_vertex_dimension(path->depth);
    CrtVertex vertex;
    CrtSurface *surface = &vertex.surface;
    vertex.surface = crt_surface(ctx, hit);
    vertex.wo = -path->ray.d;
    if (CRT_HAS(MEDIA)) {
        surface->medium = crt_medium_of(ctx, surface->material);
        surface->touches = crt_touches(ctx, hit);
    }
    if (CRT_HAS(MIX))
        surface->material =
            path->met != CRT_NONE
                ? path->met
                : crt_chosen_material(ctx, surface, path->ray.d, &path->sampler, dimension + CRT_DIM_MIX);
    if (CRT_HAS(MEDIA)) crt_absorb(ctx, path, surface);
    if (CRT_HAS(AREA_LIGHT) && surface->light != CRT_NONE) crt_add_emission(ctx, path, surface, hit.t);

    const int first = CRT_HAS(AOV) && scene->aovs != 0u && path->depth == 0u;
    if (!first && path->depth >= scene->max_depth) return 0;
    crt_vertex_prepare(ctx, &vertex, hit.slot, path->wavelengths.position, path->throughput,
                       crt_sees_face(ctx, surface->material, path->depth), first);
    if (first) {
        path->first.normal = vertex.bsdf.ns;
        path->first.depth = hit.t * scene->depth_scale;
        path->first.primitive = hit.id;
        path->first.albedo = vertex.bsdf.albedo;
        if (path->depth >= scene->max_depth) return 0;
    }

    if (CRT_HAS(NEE) && scene->nee != CRT_NEE_NONE && scene->lights.count != 0u &&
        !crt_vertex_is_delta(&vertex))
        crt_sample_lights(ctx, path, &vertex, dimension, shadow);
    return crt_continue(ctx, path, &vertex, dimension) && crt_roulette(ctx, path, dimension);
}

CRT_KERNEL_END

#endif
