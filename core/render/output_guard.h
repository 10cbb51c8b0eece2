/// Refuses outputs that would replace an input file, another output, or a film that holds more samples.
#pragma once

#include "scene/scene.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace crt {

/// Throws crt::Error(Usage) when an output is one of the inputs, by whatever name or link, or when two
/// outputs are one file. Names in `films` may coincide with each other: the same film is written to all of
/// them.
void refuseOverInputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
                      const std::vector<std::string>& films = {});

/// Protects other files from the output names of a scene file, which may come from an untrusted source.
/// Throws crt::Error(Usage) for an output outside the working directory and the scene's folder, for a hidden
/// file or folder, for an extension that is not an image's, and, unless `replace`, for an existing file that
/// crt did not write.
void refuseForeignPlaces(const std::vector<Output>& outputs, const std::string& scene_file, bool replace);

/// Films that lie where films will be written. [one thread]
class FilmGuard {
public:
    /// Looks at what is there at `path`; with `replace` it may be anything. Throws crt::Error(Usage) for a
    /// file that is no whole film, unless the name is only one of crt's making (`wanted` is false).
    void look(const std::string& path, bool wanted, bool replace);

    /// Remembers the film that this run resumes. The run may replace it, but not a larger film that another
    /// program writes to the same name in the meantime.
    void goOnFrom(const std::string& path);

    /// Throws crt::Error(Usage) when one of those that are wanted holds more than the `samples` per pixel
    /// that this run ends with.
    void requireRoom(std::uint64_t samples) const;

    /// Where a film of `samples` per pixel goes that is meant for `path`: there, or beside it while a larger
    /// one lies there. Checks again if another program has written to `path`.
    std::string placeFor(const std::string& path, std::uint64_t samples);
    /// To be called when it is written: a smaller film of this run beside it is removed.
    void written(const std::string& path);

private:
    struct Place {
        std::uint64_t samples = 0;  ///< Of the film that was there.
        bool wanted = false;
        std::string beside;  ///< Empty until needed.
        std::string file;    ///< Identity of the file that was there; empty if there was none.
    };
    std::map<std::string, Place> places_;
};

}  // namespace crt
