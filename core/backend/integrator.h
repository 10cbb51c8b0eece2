/// The C++ face of a backend's integrator: owns it, turns a status into crt::Error.
#pragma once

#include "backend/crt_backend.h"
#include "backend/loader.h"
#include "compile/compile.h"
#include "film/film.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace crt {

struct IntegratorOptions {
    /// "" for the best; an index or a part of a device name. A DeviceGroup takes several, too.
    std::string device;
    unsigned threads = 0;         ///< 0: all.
    CrtKernelChoice kernel = CRT_KERNEL_LEAN;
    unsigned tile_size = 0;       ///< 0: the backend's own.
    bool use_cache = true;
};

/// The words for a kernel, at the place of their CrtKernelChoice.
inline constexpr std::array<std::string_view, 3> kKernelWords{"lean", "full", "lean-only"};
/// Nothing for another word.
std::optional<CrtKernelChoice> kernelNamed(std::string_view word);

/// The parts that a scene for this backend may lack.
CompileOptions compileOptionsFor(const LoadedBackend& backend);

/// The shape of a film of this scene.
FilmShape filmShapeOf(const CompiledScene& compiled);

/// Samples of all pixels.
struct RenderRange {
    std::uint64_t first_sample = 0;
    std::uint64_t sample_count = 0;
};

/// Move-only. Errors: Backend (no device, unsupported scene), Device (failed, out of memory), Internal
/// (contract broken).
class Integrator {
public:
    /// Opens a device of a loaded backend.
    Integrator(const LoadedBackend& backend, const IntegratorOptions& options);
    ~Integrator();
    Integrator(Integrator&&) noexcept;
    Integrator& operator=(Integrator&&) noexcept;

    /// The scene must outlive nothing: what is needed is copied. Clears the film. `progress` gets [0,1] from
    /// backends that tell how far they are.
    void setScene(const CompiledScene& scene, const std::function<void(double)>& progress = {});

    /// Adds a range to the backend's film. `progress` gets [0,1] and returns true to cancel. Returns false
    /// when cancelled.
    bool render(const RenderRange& range, const std::function<bool(double)>& progress = {});

    /// Adds what the backend's film holds to `film` (which has this scene's shape; without samples, its
    /// contents do not matter). A film that has samples is left alone when that fails; one without is empty
    /// then.
    void readFilm(Film& film);

    CrtBackendReport report();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace crt
