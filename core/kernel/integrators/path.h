/*
 * path.h: one sample of one pixel. The value of sample s of pixel p depends on (scene, seed, p, s) alone.
 *
 * A path is advanced vertex by vertex, so that a backend may schedule vertices as it likes; crt_render_pixel
 * is the plain schedule: one loop over the vertices of one sample after another.
 */
#ifndef CRT_PATH_H
#define CRT_PATH_H

#include "kernel/geometry/bvh.h"
#include "kernel/transport/passing.h"
#include "kernel/transport/shade.h"

CRT_KERNEL_BEGIN

typedef struct CrtRayCount {
    u32 closest, shadow;
} CrtRayCount;

/* Answers what a vertex asked: adds the light that waits where nothing stops its ray. */
CRT_FN void crt_answer(const CrtContext *ctx, CrtPath *path, const CrtShadow *shadow, CrtRayCount *rays) {
    int blocked = 0;
    if (shadow->ray.reach > 0.0f) {
        rays->shadow += 1u;
        CrtPassable none = crt_none_passable(shadow->ray.reach);
        blocked = crt_trace_any(ctx, shadow->ray, &none);
    }
    if (!blocked) path->radiance = path->radiance + shadow->radiance;
}

/* crt_path_vertex where rays may pass surfaces. One loop traces the path's ray, then the shadow ray: both go
   on until something stops them. */
CRT_FN int crt_path_vertex_passing(const CrtContext *ctx, CrtPath *path, CrtRayCount *rays) {
    CrtShadow shadow;
    CrtRay ray = path->ray;
    int alive = 0;
    const int passable = crt_is_passable(ctx);
    CrtPassage way;
    way.shadow = 0;
    if (passable)
        way = crt_passage(path->depth, 0, ray.d, path->wavelengths.position, path->media, path->throughput);
    rays->closest += 1u;
    for (;;) {
        CrtHit hit = crt_no_hit(ray.reach);
        int stopped = 0; /* 1: an opaque surface stops the shadow ray */
        int last = 0;    /* 1: the shadow ray meets nothing behind `hit` */
        if (ray.reach > 0.0f) {
            if (way.shadow && (crt_has_panes(ctx) || !passable)) {
                CrtPassable met = crt_none_passable(ray.reach);
                stopped = crt_trace_any(ctx, ray, &met);
                hit = met.nearest;
                last = met.count == 1u;
            } else {
                hit = crt_trace_closest(ctx, ray);
            }
        }
        if (passable && !stopped && hit.slot != CRT_NONE &&
            crt_passes(ctx, hit, &path->sampler, &way, &ray)) {
            if (!last) continue;
            hit.slot = CRT_NONE;
        }
        if (way.shadow) { /* the shadow ray of the vertex */
            if (!stopped && hit.slot == CRT_NONE) path->radiance = path->radiance + way.carried;
            return alive;
        }
        if (passable) {
            hit.t = hit.t + dot3(ray.o - path->ray.o, ray.d); /* from where the path's ray began */
            path->throughput = way.carried;
            path->met = way.material;
        }
        const u32 depth = path->depth;
        alive = crt_shade(ctx, path, hit, &shadow);
        if (!(CRT_HAS(NEE) && shadow.asked)) return alive;
        /* On processors a search that never asks for panes is faster: 2 % of all instructions. On GPUs a
           second copy of the search spills 400 bytes of registers. */
        if (CRT_SIMD8 && !passable) {
            crt_answer(ctx, path, &shadow, rays);
            return alive;
        }
        ray = shadow.ray;
        if (ray.reach > 0.0f) rays->shadow += 1u;
        way.shadow = 1;
        way.carried = shadow.radiance;
        if (passable)
            way = crt_passage(depth, 1, ray.d, path->wavelengths.position,
                              CRT_HAS(MEDIA) ? shadow.media : 0u, shadow.radiance);
    }
}

/* Traces the path's ray to its next vertex, shades it and answers what it asks. Returns 0 when the path has
   ended. */
CRT_FN int crt_path_vertex(const CrtContext *ctx, CrtPath *path, CrtRayCount *rays) {
    if (CRT_HAS(OPACITY) || CRT_HAS(THIN_DIELECTRIC)) return crt_path_vertex_passing(ctx, path, rays);
    CrtShadow shadow;
    rays->closest += 1u;
    const int alive = crt_shade(ctx, path, crt_trace_closest(ctx, path->ray), &shadow);
    if (CRT_HAS(NEE) && shadow.asked) crt_answer(ctx, path, &shadow, rays);
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

/* What a sample adds to the bins and the responses of a spectral film: the radiance of its four wavelengths,
   over the density of each. */
CRT_FN void crt_add_spectrum(const CrtContext *ctx, const CrtPath *path, CRT_GLOBAL f64 *pixel) {
    CRT_GLOBAL const CrtSpectralFilm *film =
        CRT_ARRAY(CrtSpectralFilm, ctx->blob, ctx->scene->spectral_film);
    const vec4 position = path->wavelengths.position;
    vec4 inverse_pdf;
    (void)crt_four_wavelengths(ctx, path->wavelengths.u, &inverse_pdf);
    const vec4 integral = path->radiance * inverse_pdf;
    CRT_GLOBAL f64 *pairs = pixel + 2u * film->channel;
    CRT_ROLLED for (u32 lane = 0u; lane < 4u; ++lane) {
        const f32 bin = (crt_lane(position, lane) - film->first) * film->per_nm;
        if (bin >= 0.0f && bin < (f32)film->bins)
            crt_film_add(pairs + 2u * (u32)bin, (f64)crt_lane(integral, lane) * (f64)film->per_nm);
    }
    pairs += 2u * film->bins;
    CRT_GLOBAL const f32 *table = CRT_ARRAY(f32, ctx->blob, film->responses);
    CRT_ROLLED for (u32 k = 0u; k < film->responses.count; ++k)
        crt_film_add(pairs + 2u * k,
                     (f64)sum4(crt_lookup4(table + k * CRT_SPECTRUM_STRIDE, position) * integral));
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
        if (CRT_HAS(SPECTRAL_FILM) && scene->spectral_film.count != 0u)
            crt_add_spectrum(ctx, &work->path, pairs);
        work->valid += 1u;
    }
    work->done += 1u;
}

/* Begins the pixel's next sample. */
CRT_FN void crt_begin_sample(const CrtContext *ctx, CrtPixelWork *work) {
    crt_path_begin(ctx, &work->path, work->x, work->y, work->first_sample + work->done);
}

/* Takes the pixel one vertex further, into its next sample where a path has ended. Returns 0 when the last
 * sample is done. */
CRT_FN int crt_pixel_vertex(const CrtContext *ctx, CrtPixelWork *work, CrtRayCount *rays) {
    if (work->done >= work->sample_count) return 0;
    if (!work->alive) crt_begin_sample(ctx, work);
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
   and rays to *rays. On a GPU a lane whose path has ended either waits for the others of its warp, whose
   next camera rays then go the same way through the tree; or, where there is no tree and all rays cost the
   same, it begins its next sample at once, in one flat loop over the vertices of all samples (measured:
   docs/decisions/0039-what-a-lane-does-when-its-path-ends.md). */
CRT_FN void crt_render_pixel(const CrtContext *ctx, u32 x, u32 y, u64 first_sample, u32 sample_count,
                             CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives,
                             CrtRayCount *rays) {
    CrtPixelWork work = crt_pixel_begin(ctx, x, y, first_sample, sample_count, sums, counts, primitives);
    const int waits = CRT_HAS(VIEW) ? 0 : CRT_HAS(BVH);
    if (waits) {
        while (work.done < work.sample_count) {
            crt_begin_sample(ctx, &work);
            while (crt_path_vertex(ctx, &work.path, rays)) continue;
            crt_add_sample(ctx, &work, crt_to_xyz(ctx, work.path.wavelengths, work.path.radiance));
        }
    } else {
        while (crt_pixel_vertex(ctx, &work, rays)) continue;
    }
    crt_pixel_end(&work);
}

CRT_KERNEL_END

#endif
