/*
 * value.h: the one reader of the values of materials and lights. Tables and textures are not compiled for a
 * scene that has none.
 */
#ifndef CRT_VALUE_H
#define CRT_VALUE_H

#include "kernel/values/texture.h"

CRT_KERNEL_BEGIN

/* A value at the path's wavelengths; all four are the same for a number. `at`: the place of the value; 0
   where there is none, as for the environment, whose values do not depend on a place. */
CRT_FN vec4 crt_value_at(const CrtContext *ctx, CrtValue value, const CrtFacePlace *at, vec4 position) {
    if (CRT_HAS(TEXTURE) && at != 0) {
        value = crt_resolve_pattern(ctx, value, at);
        if (crt_is_texture(value)) return crt_texture(*ctx, value & CRT_VALUE_INDEX, *at, position);
    }
    if (CRT_HAS(TABLE)) {
        if ((value & CRT_VALUE_REFERENCE) != 0u)
            return crt_spectrum(ctx, value & CRT_VALUE_INDEX, position);
    }
    return splat4(crt_from_bits(value));
}

/* The same on a surface, or 0. */
CRT_FN vec4 crt_value(const CrtContext *ctx, CrtValue value, const CrtSurface *surface, vec4 position) {
    return crt_value_at(ctx, value, surface != 0 ? &surface->at : 0, position);
}

CRT_KERNEL_END

#endif
