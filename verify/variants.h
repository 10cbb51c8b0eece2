/// Scenes that between them need everything the kernel has, for relations that hold of every scene; and the
/// kernel as this program holds it.
#pragma once

#include "compile/compile.h"
#include "verify/context.h"

#include <string>
#include <vector>

namespace crt::verify {

struct Variant {
    std::string name;
    Scene scene;
    std::uint64_t needs = 0;  ///< Features.
};

/// Rooms with a lamp, a conductor, a mirror, glass, dispersive glass with smooth normals and a sky: every
/// sampler, accelerator, filter and view once.
std::vector<Variant> variants(int resolution);

/// Asks of every variant that the backend has the features for, or of every `step`-th variant.
void forEachVariant(Context& context, int resolution, void (*ask)(Context&, const Variant&),
                    std::size_t step = 1);

/// All AOVs of first hits.
inline constexpr std::uint32_t kAllAovs = kAovsOfFirstHits;

/// The film of crt's own build of the kernel, on one thread, in portable C++. Every backend must give the
/// same.
Film portableFilm(const Scene& scene, const Render& how);

}  // namespace crt::verify
