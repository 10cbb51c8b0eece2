/*
 * integrator.h: the scene's integrator, chosen among the rows of CRT_INTEGRATOR_LIST that this kernel has.
 * Schedules call these functions; they know no integrator by name.
 */
#ifndef CRT_INTEGRATOR_H
#define CRT_INTEGRATOR_H

#include "kernel/integrators/path.h"
#include "kernel/integrators/splat_test.h"
#include "kernel/integrators/views.h"

CRT_KERNEL_BEGIN

/* True if the scene's integrator is the row's, which is among those of such kernels. */
#define CRT_CHOOSES_ALL(number) 1
#define CRT_CHOOSES_SPLAT(number) (CRT_HAS(SPLAT) && ctx->scene->integrator == number)
#define CRT_CHOOSES_VIEW(number) (CRT_HAS(VIEW) && ctx->scene->integrator == number)

#define CRT_ROW_ADVANCES(number, NAME, Name, word, stem, KERNELS, light, surfaces, splats) \
    if (CRT_CHOOSES_##KERNELS(number)) return crt_##stem##_advance(ctx, path, film, rays);
#define CRT_ROW_ENDS(number, NAME, Name, word, stem, KERNELS, light, surfaces, splats) \
    if (CRT_CHOOSES_##KERNELS(number)) return crt_##stem##_end(ctx, path);

/* Takes a sample one vertex further. Returns 0 when it has ended. `film`: where the sample will be added,
   for those that splat. */
CRT_FN int crt_integrator_advance(const CrtContext *ctx, CrtPath *path, const CrtFilmPixel *film,
                                  CrtRayCount *rays) {
    CRT_INTEGRATOR_LIST(CRT_ROW_ADVANCES)
}

/* XYZ of a sample that has ended. */
CRT_FN vec4 crt_integrator_end(const CrtContext *ctx, const CrtPath *path) {
    CRT_INTEGRATOR_LIST(CRT_ROW_ENDS)
}

CRT_KERNEL_END

#endif
