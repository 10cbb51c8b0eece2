// The example backend with a mistake in its physics: the light of lamps is not weighted by the cosine at
// which it arrives on a diffuse surface. `crt verify` must fail it, and say so.
#include "backend/sdk/plugin_guard.h"
#include "kernel/light.h"

namespace crt::kernel {
inline f32 crt_lambert_without_cosine(f32) { return CRT_INV_PI; }
}  // namespace crt::kernel

// From here on, in path.h: the sampling of directions, in bsdf.h, stays as it is.
#define crt_lambert crt_lambert_without_cosine
#include "../../docs/example_backend/example_backend.cpp"
