// The example backend with a mistake in its physics: the light of lamps is not weighted by the cosine at
// which it arrives on a diffuse surface. `crt verify` must fail it, and say so.
#include "backend/sdk/plugin_guard.h"
#include "kernel/lights/light.h"

namespace crt::kernel {
inline vec4 crt_bsdf_without_cosine(const CrtBsdf* bsdf, vec3 wi, f32* pdf) {
    const vec4 value = crt_bsdf(bsdf, wi, pdf);
    const f32 cosine = dot3(wi, bsdf->ns);
    return cosine > 0.0f ? value / cosine : value;
}
}  // namespace crt::kernel

// From here on, in layers.h: the sampling of directions, in bsdf.h, stays as it is.
#define crt_bsdf crt_bsdf_without_cosine
#include "../../docs/example_backend/example_backend.cpp"
