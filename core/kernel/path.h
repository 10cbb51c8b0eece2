/*
 * path.h: one sample of one pixel. The value of sample s of pixel p depends on (scene, seed, p, s) alone.
 *
 * A path is advanced vertex by vertex, so that a backend may schedule vertices as it likes; crt_render_pixel
 * is the plain schedule: one loop over the vertices of one sample after another.
 */
#ifndef CRT_PATH_H
#define CRT_PATH_H

#include "point_light.h"

CRT_KERNEL_BEGIN

typedef struct CrtRayCount {
    u32 closest, shadow;
} CrtRayCount;

/* First-hit quantities. */
typedef struct CrtFirstHit {
    vec4 albedo; /* at the path's wavelengths */
    vec3 normal;
    f32 depth;   /* along the ray, scene units; 0 where nothing is hit */
    u32 primitive;
} CrtFirstHit;

typedef struct CrtPath {
    CrtRay ray;
    CrtSampler sampler;
    CrtWavelengths wavelengths;
    vec4 hero;        /* 1 in the lane of the hero wavelength, 0 elsewhere */
    vec4 throughput;
    vec4 radiance;
    f32 scatter_pdf;  /* of the direction that led here; 0: camera or delta, no light sampling competes */
    f32 scatter_cosine; /* of that direction with the shading normal on the side of w_o, where scatter_pdf is
                           above 0 */
    vec3 p;           /* where it was scattered: a clearance off the ray's origin */
    f32 eta_square;   /* product of squared relative indices crossed: roulette must not see the n² of being
                         inside glass */
    u32 depth;        /* scattering events so far */
    int alone;        /* only the hero wavelength is alive */
    CrtValue absorption; /* of what the ray begins in */
    CrtFirstHit first;
} CrtPath;

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
    if (CRT_HAS(DISPERSION) && (scene->features & (u32)CRT_FEATURE_DISPERSION) != 0u) {
        const u32 lane = crt_sample_bits(&path->sampler, CRT_DIM_HERO) >> 30;
        path->hero = make_vec4(lane == 0u ? 1.0f : 0.0f, lane == 1u ? 1.0f : 0.0f, lane == 2u ? 1.0f : 0.0f,
                               lane == 3u ? 1.0f : 0.0f);
    }
    path->throughput = splat4(1.0f);
    path->radiance = splat4(0.0f);
    path->scatter_pdf = 0.0f;
    path->scatter_cosine = 0.0f;
    path->p = path->ray.o;
    path->eta_square = 1.0f;
    path->depth = 0u;
    path->alone = 0;
    path->absorption = 0u;
    path->first.albedo = splat4(0.0f);
    path->first.normal = make_vec3(0.0f, 0.0f, 0.0f);
    path->first.depth = 0.0f;
    path->first.primitive = CRT_NONE;
}

/* Emission met by the ray, weighted against the chance that light sampling had found it. */
CRT_FN void crt_add_emission(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface, f32 t) {
    CRT_GLOBAL const CrtLight *emitter =
        CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + surface->light;
    const int front = dot3(surface->ng, path->ray.d) < 0.0f;
    if (!front && (emitter->flags & CRT_LIGHT_TWO_SIDED) == 0u) return;
    f32 weight = 1.0f;
    if (CRT_HAS(NEE) && ctx->scene->nee != CRT_NEE_NONE && path->scatter_pdf > 0.0f) {
        const f32 distance = length3(crt_fma3(path->ray.d, t, path->ray.o) - path->p);
        const CrtLightSeen light = crt_light_pdf(ctx, surface->light, path->p, distance);
        if (light.pdf > 0.0f) {
            /* The ray starts a clearance off p, from which lights are sampled. Close to a light that is
               another direction: both techniques estimate what arrives at p, and are weighed by the area of
               the light per probability. */
            const f32 nearer = t / distance;
            const f32 area = light.cosine / crt_abs(dot3(surface->ng, path->ray.d)) * nearer * nearer;
            const f32 ratio = light.pdf / path->scatter_pdf * area;
            if (ctx->scene->nee == CRT_NEE_ONLY || !(ratio < 1e15f)) return;
            const f32 clearance = length3(path->ray.o - path->p);
            const f32 cosines = (t + clearance / crt_abs(path->scatter_cosine)) /
                                distance; /* at p over that at the ray's origin */
            weight = area * cosines * crt_power_heuristic(ratio);
        }
    }
    path->radiance = path->radiance +
                     path->throughput *
                         crt_value(ctx, emitter->radiance, surface, path->wavelengths.position) * weight;
}

/* What a ray that meets nothing finds, weighted in the same way. */
CRT_FN void crt_add_environment(const CrtContext *ctx, CrtPath *path) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const CrtEnvironmentPlace place = crt_environment_towards(ctx, path->ray.d);
    f32 weight = 1.0f;
    if (CRT_HAS(ENVIRONMENT_LIGHT) && scene->environment_light != 0u && scene->nee != CRT_NEE_NONE &&
        path->scatter_pdf > 0.0f) {
        const f32 pdf = crt_environment_pdf(ctx, place, path->scatter_cosine);
        if (pdf > 0.0f && scene->nee == CRT_NEE_ONLY) return;
        weight = crt_power_heuristic(pdf / path->scatter_pdf);
    }
    path->radiance =
        path->radiance +
        path->throughput * crt_environment_radiance(ctx, place, path->wavelengths.position) * weight;
}

/* What is left of the path's throughput after the way to `surface`, or, with none, to nowhere. */
CRT_FN void crt_absorb(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface) {
    /* From where it was scattered: the ray began a clearance off. */
    const f32 distance = surface != 0 ? length3(surface->p - path->p) : CRT_INFINITY;
    const CrtValue absorption =
        surface != 0 ? crt_medium_before(ctx, surface, path->ray.d, path->absorption) : path->absorption;
    if (absorption == 0u) return;
    path->throughput =
        path->throughput * crt_transmittance(ctx, absorption, distance, path->wavelengths.position);
}

/* A question that a vertex asks, and what it adds to the path's radiance if nothing is met. It is answered
   before the path's next vertex. */
typedef struct CrtShadow {
    int asked;
    CrtRay ray; /* its reach is 0 or less where nothing fits in between */
    vec4 radiance;
} CrtShadow;

/* What is left of the light that waits for the answer, after its way of `distance` along wi. */
CRT_FN void crt_absorb_shadow(const CrtContext *ctx, const CrtPath *path, const CrtSurface *surface,
                              const CrtBsdf *bsdf, vec3 wi, f32 distance, CrtShadow *shadow) {
    const CrtValue absorption = crt_medium_behind(surface, bsdf, wi, path->absorption);
    if (absorption == 0u) return;
    shadow->radiance = shadow->radiance *
                       crt_transmittance(ctx, absorption, distance, path->wavelengths.position);
}

/* Next event estimation: a direction of the environment. */
CRT_FN void crt_ask_environment(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface,
                                const CrtBsdf *bsdf, u32 dimension, CrtShadow *shadow) {
    const CrtEnvironmentSample sample =
        crt_environment_sample(ctx, &path->sampler, dimension, bsdf->ns);
    const int before = dot3(sample.wi, bsdf->ng) > 0.0f;
    if (!(sample.pdf > 0.0f) || (!before && !crt_has_environment_image(ctx))) return;
    if ((bsdf->flags & (before ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS)) == 0u) return;
    const vec4 scattered = crt_bsdf_eval(bsdf, sample.wi);
    if (max4(scattered) == 0.0f) return;
    shadow->asked = 1;
    shadow->ray.o = crt_offset_origin(surface->p, surface->clearance, bsdf->ng, sample.wi);
    shadow->ray.d = sample.wi;
    shadow->ray.reach = CRT_INFINITY;
    f32 weight = 1.0f / sample.pdf;
    if (ctx->scene->nee == CRT_NEE_MIS)
        weight = weight * crt_power_heuristic(crt_bsdf_pdf(bsdf, sample.wi) / sample.pdf);
    shadow->radiance = path->throughput * scattered *
                       crt_environment_radiance(ctx, sample.place, path->wavelengths.position) * weight;
    if (CRT_HAS(ABSORPTION)) crt_absorb_shadow(ctx, path, surface, bsdf, sample.wi, CRT_INFINITY, shadow);
}

/* Next event estimation: a light without a surface. */
CRT_FN void crt_ask_point_light(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface,
                                const CrtBsdf *bsdf, u32 index, u32 dimension, CrtShadow *shadow) {
    const CrtPointLightSample light =
        crt_point_light_sample(ctx, index, &path->sampler, dimension, surface->p);
    if (!(light.irradiance > 0.0f)) return;
    const int before = dot3(light.wi, bsdf->ng) > 0.0f;
    if ((bsdf->flags & (before ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS)) == 0u) return;
    const vec4 scattered = crt_bsdf_eval(bsdf, light.wi);
    if (max4(scattered) == 0.0f) return;
    shadow->asked = 1;
    shadow->ray.o = crt_offset_origin(surface->p, surface->clearance, bsdf->ng, light.wi);
    shadow->ray.d = light.far ? light.wi : light.point - shadow->ray.o;
    shadow->ray.reach = light.far ? CRT_INFINITY : CRT_POINT_LIGHT_REACH;
    f32 weight = light.irradiance;
    if (light.pdf > 0.0f && ctx->scene->nee == CRT_NEE_MIS)
        weight = weight * crt_power_heuristic(crt_bsdf_pdf(bsdf, light.wi) / light.pdf);
    const CrtValue spectrum = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[index].radiance;
    shadow->radiance = path->throughput * scattered *
                       crt_value(ctx, spectrum, 0, path->wavelengths.position) * weight;
    if (CRT_HAS(ABSORPTION)) crt_absorb_shadow(ctx, path, surface, bsdf, light.wi, light.distance, shadow);
}

/* Next event estimation: a light, and a ray towards it. */
CRT_FN void crt_ask_light(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface,
                          const CrtBsdf *bsdf, u32 dimension, CrtShadow *shadow) {
    const u32 index = crt_light_choose(ctx, &path->sampler, dimension);
    if (CRT_HAS(ENVIRONMENT_LIGHT) && index + 1u == ctx->scene->environment_light) {
        crt_ask_environment(ctx, path, surface, bsdf, dimension, shadow);
        return;
    }
    if (CRT_HAS(POINT_LIGHT) &&
        CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[index].kind >= CRT_LIGHT_POINT) {
        crt_ask_point_light(ctx, path, surface, bsdf, index, dimension, shadow);
        return;
    }
    const CrtLightSample light = crt_light_sample(ctx, index, &path->sampler, dimension, surface->p);
    if (!(light.pdf > 0.0f)) return;
    const int before = dot3(light.wi, bsdf->ng) > 0.0f;
    if ((bsdf->flags & (before ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS)) == 0u) return;
    const vec4 scattered = crt_bsdf_eval(bsdf, light.wi);
    if (max4(scattered) == 0.0f) return;
    shadow->asked = 1;
    shadow->ray.o = crt_offset_origin(surface->p, surface->clearance, bsdf->ng, light.wi);
    shadow->ray.d = light.point - shadow->ray.o;
    shadow->ray.reach = light.reach;
    f32 weight = 1.0f / light.pdf;
    if (ctx->scene->nee == CRT_NEE_MIS) {
        /* By probabilities per area of the light (crt_add_emission): of a ray scattered at the shadow ray's
           origin pdf·|n·d|/|d|³, of light sampling pdf·cos/distance². */
        const f32 squared = dot3(shadow->ray.d, shadow->ray.d);
        const vec3 towards = shadow->ray.d * (1.0f / crt_sqrt(squared));
        const f32 ratio = crt_bsdf_pdf(bsdf, towards) * crt_abs(dot3(light.normal, towards)) *
                          light.distance * light.distance / (light.pdf * light.cosine * squared);
        weight = weight * crt_power_heuristic(ratio);
    }
    const CrtValue radiance = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[index].radiance;
    shadow->radiance = path->throughput * scattered *
                       crt_value(ctx, radiance, 0, path->wavelengths.position) * weight;
    if (CRT_HAS(ABSORPTION)) crt_absorb_shadow(ctx, path, surface, bsdf, light.wi, light.distance, shadow);
}

/* What happens to a path at `hit`, which its ray has met: it gains what is emitted there, and is scattered.
   Returns 0 when it has ended. Traces nothing: path->ray is the next ray, and *shadow may ask for another,
   whether or not the path goes on. */
CRT_FN int crt_shade(const CrtContext *ctx, CrtPath *path, CrtHit hit, CrtShadow *shadow) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    shadow->asked = 0;
    if (hit.slot == CRT_NONE) {
        if (CRT_HAS(ABSORPTION)) crt_absorb(ctx, path, 0);
        if (CRT_HAS(ENVIRONMENT) && scene->environment != CRT_NONE) crt_add_environment(ctx, path);
        if (CRT_HAS(POINT_LIGHT) && scene->point_lights.count != 0u)
            path->radiance = path->radiance +
                             path->throughput * crt_suns_seen(ctx, path->ray.d, path->scatter_pdf,
                                                              path->wavelengths.position);
        return 0;
    }
    const CrtSurface surface = crt_surface(ctx, hit);
    if (CRT_HAS(ABSORPTION)) crt_absorb(ctx, path, &surface);
    if (CRT_HAS(AREA_LIGHT) && surface.light != CRT_NONE) crt_add_emission(ctx, path, &surface, hit.t);

    const int first = CRT_HAS(AOV) && scene->aovs != 0u && path->depth == 0u;
    if (!first && path->depth >= scene->max_depth) return 0;
    CrtBsdf bsdf;
    crt_bsdf_prepare(ctx, &bsdf, &surface, -path->ray.d, path->wavelengths.position, path->throughput,
                     first);
    if (first) {
        path->first.normal = bsdf.ns;
        path->first.depth = hit.t * scene->depth_scale;
        path->first.primitive = hit.id;
        path->first.albedo = bsdf.albedo;
        if (path->depth >= scene->max_depth) return 0;
    }

    const u32 dimension = CRT_DIM_VERTEX + CRT_DIM_PER_VERTEX * path->depth;
    if (CRT_HAS(NEE) && scene->nee != CRT_NEE_NONE && scene->lights.count != 0u &&
        (bsdf.flags & CRT_BSDF_DELTA) == 0u)
        crt_ask_light(ctx, path, &surface, &bsdf, dimension, shadow);
    const CrtRandom2 u = crt_sample_2d(&path->sampler, dimension + CRT_DIM_BSDF);
    CrtRandom2 choice = u;
    if ((CRT_HAS(ROUGH_DIELECTRIC) || CRT_HAS(PLASTIC)) && (bsdf.flags & CRT_BSDF_CHOOSES) != 0u)
        choice = crt_sample_2d(&path->sampler, dimension + CRT_DIM_CHOICE);
    const CrtScatter scatter = crt_bsdf_sample(&bsdf, u, choice, path->hero, path->alone);
    if (!scatter.valid) return 0;

    path->throughput = path->throughput * scatter.weight;
    if (CRT_HAS(DISPERSION) && scatter.hero_only) {
        path->throughput = path->throughput * path->hero * 4.0f;
        path->alone = 1;
    }
    path->eta_square = path->eta_square * scatter.eta_square;
    path->scatter_pdf = scatter.pdf;
    path->scatter_cosine = dot3(scatter.wi, bsdf.ns);
    path->p = surface.p;
    if (CRT_HAS(ABSORPTION))
        path->absorption = crt_medium_behind(&surface, &bsdf, scatter.wi, path->absorption);
    path->ray.o = crt_offset_origin(surface.p, surface.clearance, surface.ng, scatter.wi);
    path->ray.d = scatter.wi;
    path->ray.reach = CRT_INFINITY;
    path->depth += 1u;

    /* Roulette on the spectral maximum. A path that carries nothing has ended in any case. */
    const f32 carried = max4(path->throughput) * path->eta_square;
    if (!(carried > 0.0f)) return 0;
    if (path->depth >= scene->roulette_depth && carried < 1.0f) {
        const f32 survive = crt_max(carried, 0.05f);
        if (!(crt_sample_1d(&path->sampler, dimension + CRT_DIM_ROULETTE) < survive)) return 0;
        path->throughput = path->throughput / survive;
    }
    return 1;
}

/* Traces the path's ray to its next vertex, shades it and answers what it asks. Returns 0 when the path has
   ended. */
CRT_FN int crt_path_vertex(const CrtContext *ctx, CrtPath *path, CrtRayCount *rays) {
    CrtShadow shadow;
    rays->closest += 1u;
    const int alive = crt_shade(ctx, path, crt_trace_closest(ctx, path->ray), &shadow);
    if (CRT_HAS(NEE) && shadow.asked) {
        int blocked = 0;
        if (shadow.ray.reach > 0.0f) {
            rays->shadow += 1u;
            blocked = crt_trace_any(ctx, shadow.ray);
        }
        if (!blocked) path->radiance = path->radiance + shadow.radiance;
    }
    return alive;
}

/* XYZ of linear sRGB (IEC 61966-2-1), for views that are colours and not light. */
CRT_FN vec4 crt_srgb_to_xyz(f32 r, f32 g, f32 b) {
    return make_vec4(0.41239080f * r + 0.35758434f * g + 0.18048079f * b,
                     0.21263901f * r + 0.71516868f * g + 0.07219232f * b,
                     0.01933082f * r + 0.11919478f * g + 0.95053215f * b, 0.0f);
}

/* Figure 1 of the paper that crt grew out of: shading normals as colour, or the objects' bounding boxes. */
CRT_FN vec4 crt_view(const CrtContext *ctx, CrtPath *path, CrtRayCount *rays) {
    rays->closest += 1u;
    if (ctx->scene->view == CRT_VIEW_NORMALS) {
        const CrtHit hit = crt_trace_closest(ctx, path->ray);
        if (hit.slot == CRT_NONE) return splat4(0.0f);
        const CrtSurface surface = crt_surface(ctx, hit);
        const vec3 n = dot3(path->ray.d, surface.ng) > 0.0f ? -surface.ns : surface.ns;
        path->first.normal = n;
        path->first.depth = hit.t * ctx->scene->depth_scale;
        path->first.primitive = hit.id;
        path->first.albedo = splat4(1.0f);
        return crt_srgb_to_xyz(0.5f * (V3X(n) + 1.0f), 0.5f * (V3Y(n) + 1.0f), 0.5f * (V3Z(n) + 1.0f));
    }
    CRT_GLOBAL const CrtObject *objects = CRT_ARRAY(CrtObject, ctx->blob, ctx->scene->objects);
    const CrtSlab slab = crt_slab(path->ray);
    f32 nearest = CRT_INFINITY;
    u32 which = CRT_NONE;
    for (u32 k = 0u; k < ctx->scene->objects.count; ++k) {
        const f32 t = crt_box(objects[k].lower, objects[k].upper, path->ray, slab, CRT_INFINITY);
        if (t > 0.0f && t < nearest) {
            nearest = t;
            which = k;
        }
    }
    if (which == CRT_NONE) return splat4(0.0f);
    /* A colour an object, in one of three shades by the axis of the face that the ray meets. */
    const u32 h = crt_hash(which + 1u);
    const vec3 c = abs3((path->ray.o + path->ray.d * nearest) -
                        (crt_load3(objects[which].lower) + crt_load3(objects[which].upper)) * 0.5f);
    const vec3 extent = (crt_load3(objects[which].upper) - crt_load3(objects[which].lower)) * 0.5f;
    const f32 fx = V3X(extent) - V3X(c), fy = V3Y(extent) - V3Y(c), fz = V3Z(extent) - V3Z(c);
    const f32 shade = fx < fy ? (fx < fz ? 0.6f : 0.8f) : (fy < fz ? 1.0f : 0.8f);
    return crt_srgb_to_xyz(shade * (0.25f + 0.75f * crt_unit(h)), shade * (0.25f + 0.75f * crt_unit(h << 8)),
                           shade * (0.25f + 0.75f * crt_unit(h << 16)));
}

CRT_FN void crt_film_add(CRT_GLOBAL f64 *pair, f64 value) {
    CrtSum sum;
    sum.hi = pair[0];
    sum.lo = pair[1];
    sum = crt_sum_add(sum, value);
    pair[0] = sum.hi;
    pair[1] = sum.lo;
}

/* What a sample adds to the channels of each AOV of the first hit: as many components as it has channels. */
CRT_FN vec4 crt_first_hit_albedo(const CrtContext* ctx, const CrtPath* path) {
    return crt_to_xyz(ctx, path->wavelengths, path->first.albedo);
}
CRT_FN vec4 crt_first_hit_normal(const CrtContext* ctx, const CrtPath* path) {
    (void)ctx;
    return make_vec4(V3X(path->first.normal), V3Y(path->first.normal), V3Z(path->first.normal), 0.0f);
}
CRT_FN vec4 crt_first_hit_depth(const CrtContext* ctx, const CrtPath* path) {
    (void)ctx;
    return splat4(path->first.depth);
}

CRT_FN void crt_film_add_vector(CRT_GLOBAL f64* pairs, u32 width, vec4 value) {
    crt_film_add(pairs, (f64)V4X(value));
    if (width > 1u) crt_film_add(pairs + 2, (f64)V4Y(value));
    if (width > 2u) crt_film_add(pairs + 4, (f64)V4Z(value));
    if (width > 3u) crt_film_add(pairs + 6, (f64)V4W(value));
}

/* AOV channels of one sample, into the pixel's channel pairs. */
#define CRT_ADD_CHANNEL_FIRST_HIT(stem, width) \
    if (scene->stem##_channel != 0u)           \
        crt_film_add_vector(pixel + 2u * scene->stem##_channel, width, crt_first_hit_##stem(ctx, path));
#define CRT_ADD_CHANNEL_SAMPLES(stem, width) /* crt_add_sample */
#define CRT_ADD_CHANNEL(bit, NAME, Name, stem, width, SOURCE, name, exr) \
    CRT_ADD_CHANNEL_##SOURCE(stem, width)
CRT_FN void crt_add_aovs(const CrtContext *ctx, const CrtPath *path, CRT_GLOBAL f64 *pixel) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    CRT_CHANNEL_LIST(CRT_ADD_CHANNEL)
}

/* A pixel of the crop window, some of whose samples are being taken: their sums go to its place in the film.
 */
typedef struct CrtPixelWork {
    u32 x, y;
    u64 first_sample;
    u32 sample_count;
    u32 done, valid;           /* samples: so far; and of these, finite ones */
    int alive;                 /* `path` has not ended */
    CRT_GLOBAL f64 *pairs;     /* the pixel's channels */
    CRT_GLOBAL u64 *count;
    CRT_GLOBAL u32 *primitive; /* may be null */
    CrtPath path;
} CrtPixelWork;

/* `sums`, `counts` and `primitives` as in CrtFilmView, for the whole film; `primitives` may be null. */
CRT_FN CrtPixelWork crt_pixel_begin(const CrtContext *ctx, u32 x, u32 y, u64 first_sample, u32 sample_count,
                                    CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts,
                                    CRT_GLOBAL u32 *primitives) {
    const u64 pixel = (u64)y * ctx->scene->width + x;
    CrtPixelWork work;
    work.x = x;
    work.y = y;
    work.first_sample = first_sample;
    work.sample_count = sample_count;
    work.done = work.valid = 0u;
    work.alive = 0;
    work.pairs = sums + pixel * ctx->scene->channels * 2u;
    work.count = counts + pixel;
    work.primitive = primitives;
    if (primitives != 0) work.primitive += pixel;
    return work;
}

/* Adds the sample whose path has ended. One that is not finite is not counted either. */
CRT_FN void crt_add_sample(const CrtContext *ctx, CrtPixelWork *work, vec4 xyz) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    CRT_GLOBAL f64 *pairs = work->pairs;
    if (crt_is_finite(V4X(xyz)) && crt_is_finite(V4Y(xyz)) && crt_is_finite(V4Z(xyz))) {
        const f64 luminance = (f64)V4Y(xyz);
        crt_film_add(pairs + 0, (f64)V4X(xyz));
        crt_film_add(pairs + 2, luminance);
        crt_film_add(pairs + 4, (f64)V4Z(xyz));
        if (scene->square_channel != 0u)
            crt_film_add(pairs + 2u * scene->square_channel, luminance * luminance);
        if (CRT_HAS(REPLICATES) && scene->replicate_shift != 0u) {
            const u32 replicate = crt_replicate(work->first_sample + work->done, scene->replicate_shift);
            if (replicate + 1u < 1u << scene->replicate_shift)
                crt_film_add(pairs + 2u * (scene->replicate_channel + replicate), luminance);
        }
        if (CRT_HAS(AOV)) {
            if (scene->channels > CRT_CHANNELS_BASE) crt_add_aovs(ctx, &work->path, pairs);
            if (work->primitive != 0 && work->valid == 0u && *work->count == 0u)
                *work->primitive = work->path.first.primitive;
        }
        work->valid += 1u;
    }
    work->done += 1u;
}

/* Takes the pixel one vertex further, into its next sample where a path has ended. Returns 0 when the last
 * sample is done. */
CRT_FN int crt_pixel_vertex(const CrtContext *ctx, CrtPixelWork *work, CrtRayCount *rays) {
    if (work->done >= work->sample_count) return 0;
    if (!work->alive) crt_path_begin(ctx, &work->path, work->x, work->y, work->first_sample + work->done);
    vec4 xyz = splat4(0.0f);
    if (CRT_HAS(VIEW) && ctx->scene->view != CRT_VIEW_PATH) {
        xyz = crt_view(ctx, &work->path, rays);
    } else {
        work->alive = crt_path_vertex(ctx, &work->path, rays);
        if (work->alive) return 1;
        xyz = crt_to_xyz(ctx, work->path.wavelengths, work->path.radiance);
    }
    crt_add_sample(ctx, work, xyz);
    return 1;
}

CRT_FN void crt_pixel_end(CrtPixelWork *work) { *work->count += work->valid; }

/* ADDS samples [first_sample, first_sample + sample_count) of pixel (x, y) of the crop window to the film,
   and rays to *rays. One flat loop over the vertices of all samples, so that on a GPU a lane whose path has
   ended begins its next sample while others go on bouncing. */
CRT_FN void crt_render_pixel(const CrtContext *ctx, u32 x, u32 y, u64 first_sample, u32 sample_count,
                             CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives,
                             CrtRayCount *rays) {
    CrtPixelWork work = crt_pixel_begin(ctx, x, y, first_sample, sample_count, sums, counts, primitives);
    while (crt_pixel_vertex(ctx, &work, rays)) continue;
    crt_pixel_end(&work);
}

CRT_KERNEL_END

#endif
