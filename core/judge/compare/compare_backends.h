/// `crt compare --backends`: do backends render the same scene to the same image? With one seed bit by bit,
/// with other seeds by statistics, which also judge backends that never promised the same bits.
#pragma once

#include "judge/compare/compare.h"
#include "judge/stats/image_tests.h"
#include "render/watch.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

struct BackendComparisonOptions {
    std::vector<std::string> backends;  ///< Two or more; the last is what the others are compared with.
    std::uint64_t samples = 0;  ///< Per pixel and replicate; 0: so many that all replicates together have
                                ///< the scene's, a power of two.
    std::uint32_t replicates = 16;      ///< Of each backend, each with a different seed.
    stats::GateOptions gate;
};

/// One backend against the last.
struct BackendAgainst {
    std::string backend, device;
    CompareResult same_seed;
    stats::GateResult other_seeds;      ///< Channels X, Y, Z.
    std::uint64_t invalid_samples = 0;  ///< NaN or infinite, of both.
    stats::Verdict verdict = stats::Verdict::Inconclusive;
    std::uint64_t samples_needed =
        0;  ///< Per replicate, for equal backends to pass where more samples are needed; 0: unknown.
};

struct BackendComparison {
    std::string reference, reference_device;
    std::string scene_file;
    std::uint32_t width = 0, height = 0;
    std::uint64_t samples = 0, seed = 0;
    std::uint32_t replicates = 0;
    stats::GateOptions gate;
    double seconds = 0;
    std::vector<BackendAgainst> backends;
    /// All agree beyond doubt.
    bool passes() const;
};

/// Renders in this process. Throws crt::Error(Usage) for fewer than two backends or replicates, Backend when
/// one cannot run, Device when one fails.
BackendComparison compareBackends(const Scene& scene, const BackendComparisonOptions& options, Watch& watch);

/// A few lines without a final newline.
std::string backendComparisonText(const BackendComparison& comparison);
std::string backendComparisonJson(const BackendComparison& comparison);

}  // namespace crt
