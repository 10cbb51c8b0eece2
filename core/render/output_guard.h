/// What an output must not replace: a file that the run reads, another of its outputs, a film that holds
/// more samples.
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

/// What a scene file names as its outputs, or what is called after it, may come from anybody. Throws
/// crt::Error(Usage) when an output is neither below the folder where crt was started nor below the scene's
/// own; when its name, or that of a folder on the way, begins with a dot or does not end as images do; and,
/// unless `replace`, when a file is there that is no image of crt's.
void refuseForeignPlaces(const std::vector<Output>& outputs, const std::string& scene_file, bool replace);

/// Films that lie where films will be written. [one thread]
class FilmGuard {
public:
    /// Looks at what is there at `path`; with `replace` it may be anything. Throws crt::Error(Usage) for a
    /// file that is no whole film, unless the name is only one of crt's making (`wanted` is false).
    void look(const std::string& path, bool wanted, bool replace);

    /// For a film that this run goes on from: what is there may be replaced, what another program puts there
    /// meanwhile only by a larger one.
    void goOnFrom(const std::string& path);

    /// Throws crt::Error(Usage) when one of those that are wanted holds more than the `samples` per pixel
    /// that this run ends with.
    void requireRoom(std::uint64_t samples) const;

    /// Where a film of `samples` per pixel goes that is meant for `path`: there, or beside it while a larger
    /// one lies there. Looks again where another program has written since.
    std::string placeFor(const std::string& path, std::uint64_t samples);
    /// To be called when it is written: a smaller film of this run beside it is removed.
    void written(const std::string& path);

private:
    struct Place {
        std::uint64_t samples = 0;  ///< Of the film that was there.
        bool wanted = false;
        std::string beside;  ///< Empty until needed.
        std::string file;    ///< Which file was there; empty: none.
    };
    std::map<std::string, Place> places_;
};

}  // namespace crt
