/*
 * value.h: the one reader of what materials and lights are made of. A kind that no value of the scene has is
 * not compiled.
 */
#ifndef CRT_VALUE_H
#define CRT_VALUE_H

#include "surface.h"

CRT_KERNEL_BEGIN

/* A value at the path's wavelengths; all four are the same for a number. `surface`: where it is asked for; 0
   where there is none, as for the environment. No kind depends on the place yet. */
CRT_FN vec4 crt_value(const CrtContext *ctx, CrtValue value, const CrtSurface *surface, vec4 position) {
    (void)surface;
    if (!CRT_HAS(TABLE)) return splat4(crt_from_bits(value));
    if (CRT_HAS(CONSTANT)) {
        if ((value & CRT_VALUE_REFERENCE) == 0u) return splat4(crt_from_bits(value));
    }
    return crt_spectrum(ctx, value & CRT_VALUE_INDEX, position);
}

CRT_KERNEL_END

#endif
