/// Lets a caller follow long work and end it early.
#pragma once

#include <crt/export.h>

#include <cstdint>
#include <optional>
#include <string_view>

CRT_API_NAMESPACE_BEGIN

/// Progress of a render.
struct Progress {
    double samples = 0;                ///< Per pixel, those of an earlier film included.
    std::uint64_t samples_wanted = 0;  ///< Per pixel; 0: as many as the time allows.
    double seconds = 0;                ///< Since the first sample of this run.
    double fraction = 0;  ///< In [0, 1]: of the samples or of the time, whichever ends the render first.
    double seconds_left = -1;     ///< Negative: unknown.
    double paths_per_second = 0;  ///< 0: unknown.
    /// The image's error, relative to its mean luminance: with probability 95 % the root mean square error
    /// over its pixels is at most this. Nothing while it is not known.
    std::optional<double> relative_error;
};

enum class MessageLevel : int { Debug = 0, Info = 1, Warning = 2, Error = 3 };

/// Derive from it what is of interest. Two calls of libcrt at once, on two threads, need a Watch each; each
/// hears only of its own call, on the calling thread or on threads that work for it.
class CRT_API Watch {
public:
    Watch();
    virtual ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    /// Called often while samples are rendered. [any thread, one call at a time]
    virtual void progress(const Progress& now);
    /// Asked between chunks of at most half a second: true ends the render, whose film holds what was
    /// rendered. [the calling thread]
    virtual bool stop();
    /// The name of the work that begins, before the first sample: "reading bunny.obj". [any thread, one call
    /// at a time]
    virtual void stage(std::string_view what);
    /// One line. Unless overridden, warnings and errors go to stderr and the rest is dropped, as they do in
    /// calls without a Watch. [any thread, one call at a time]
    virtual void message(MessageLevel level, std::string_view text);
};

CRT_API_NAMESPACE_END
