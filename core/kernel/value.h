/*
 * value.h: the one reader of what materials and lights are made of. Tables are not compiled for a scene of
 * constants.
 */
#ifndef CRT_VALUE_H
#define CRT_VALUE_H

#include "surface.h"

CRT_KERNEL_BEGIN

/* A value at the path's wavelengths; all four are the same for a number. `surface`: where it is asked for; 0
   where there is none, as for the environment. No kind depends on the place yet. */
CRT_FN vec4 crt_value(const CrtContext *ctx, CrtValue value, const CrtSurface *surface, vec4 position) {
    (void)surface;
    if (CRT_HAS(TABLE)) {
        if ((value & CRT_VALUE_REFERENCE) != 0u)
            return crt_spectrum(ctx, value & CRT_VALUE_INDEX, position);
    }
    return splat4(crt_from_bits(value));
}

CRT_KERNEL_END

#endif
