/// Scene → film.
#pragma once

#include <crt/error.h>
#include <crt/export.h>
#include <crt/film.h>
#include <crt/scene.h>
#include <crt/watch.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

CRT_API_NAMESPACE_BEGIN

struct RenderOptions {
    std::string backend =
        "auto";             ///< "cuda", "embree", "opencl", a path of a plugin; "auto": the best here.
    std::string device{};   ///< Index or part of a device name, "0,1", or "all"; empty: the best.
    unsigned threads = 0;   ///< Host threads; 0: all. Never changes the image.
    bool use_cache = true;  ///< Of compiled kernels, on disk.

    /// Samples per pixel in the film at the end; 0: the scene's number, or as many as time limit and target
    /// error allow.
    std::uint64_t samples = 0;
    /// Exactly the samples [first, second) instead, for renders in parts.
    std::optional<std::pair<std::uint64_t, std::uint64_t>> sample_range{};
    double time_limit_seconds = 0;  ///< 0: none.
    double target_error = 0;        ///< Stop at this half-width, relative to the mean luminance; 0: none.

    /// For the report, whose "error" is null otherwise. Of a part of the samples the estimate is of little
    /// use, and takes as long as adding a film; Film::error() gives it at any time.
    bool estimate_error = true;
};

/// Reason why sampling ended.
enum class StopReason : int {
    Samples,  ///< Every sample asked for is in the film.
    Time,     ///< The time is up.
    Target,   ///< The target error is reached.
    Watch,    ///< Watch::stop() said so.
};

struct Rendered {
    Film film;
    StopReason stop = StopReason::Samples;
    /// Work and cost of the run, as JSON: the report that crt render writes next to its images.
    std::string report_json;
};

/// The device failed after the first samples.
class CRT_API RenderFailed : public Error {
public:
    RenderFailed(const Error& error, Film film);
    ~RenderFailed() override;
    RenderFailed(const RenderFailed&);
    RenderFailed& operator=(const RenderFailed&);

    /// The samples that were rendered before the failure.
    const Film& film() const { return *film_; }

private:
    std::shared_ptr<const Film> film_;
};

/// Renders a scene. May be called by several threads at once; each render gives the bits of one alone.
/// Throws crt::Error.
CRT_API Rendered render(const Scene& scene, const RenderOptions& options = {}, Watch* watch = nullptr);
/// The same, from an earlier film of the scene on: samples that it has are not rendered again.
CRT_API Rendered render(const Scene& scene, Film earlier, const RenderOptions& options = {},
                        Watch* watch = nullptr);

/// Renders of one scene that follow each other, its samples in parts say: the devices stay open and the
/// scene compiled from one to the next, as long as the backend, its devices, the threads and use_cache are
/// the same. Each gives the bits of crt::render. One thread at a time.
class CRT_API Session {
public:
    /// Opens nothing yet.
    explicit Session(const Scene& scene);
    ~Session();
    Session(Session&&) noexcept;
    Session& operator=(Session&&) noexcept;

    /// As crt::render. A failure of a device closes it; the next render opens it again.
    Rendered render(const RenderOptions& options = {}, Watch* watch = nullptr);
    Rendered render(Film earlier, const RenderOptions& options = {}, Watch* watch = nullptr);

    struct Impl;

private:
    std::unique_ptr<Impl> impl_;
};

CRT_API_NAMESPACE_END
