/*
 * ray.h: a ray, or a segment of one.
 */
#ifndef CRT_RAY_H
#define CRT_RAY_H

#include "kernel/dialect/math.h"

CRT_KERNEL_BEGIN

/* `reach` is how far the segment goes, in lengths of d: infinity, or 1 for a shadow ray that ends at o + d.
 */
typedef struct CrtRay {
    vec3 o, d;
    f32 reach;
} CrtRay;

CRT_KERNEL_END

#endif
