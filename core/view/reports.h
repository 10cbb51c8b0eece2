/// One-time requests of a page: a pixel, the image as files, the devices.
#pragma once

#include "view/planes.h"
#include "view/snapshot.h"

#include <cstdint>
#include <optional>
#include <string>

namespace crt {

/// Value, error, surface and spectrum of a pixel of the crop window, as JSON. Throws crt::Error(Usage) for
/// one outside it.
std::string pixelJson(const Snapshot& snapshot, std::uint32_t x, std::uint32_t y);

/// Distance of the surface along the ray through a place of the crop window, (0, 0) to (1, 1); nothing if
/// there is no surface, or the film lacks the distance.
std::optional<double> depthAt(const Snapshot& snapshot, double x, double y);

/// A file that a browser saves.
struct SavedFile {
    std::string name, bytes;
};

/// An EXR file with the image and all that the film holds. Its name begins with `stem`. Throws
/// crt::Error(Usage) for a preview, and crt::Error(Output).
SavedFile exrOf(const Snapshot& snapshot, const std::string& stem);
/// A PNG file of what pages show: for the image what `crt render` writes with that exposure and white.
/// Throws as exrOf(), and for a plane that the film does not hold yet.
SavedFile pngOf(const Snapshot& snapshot, const Display& display, const std::string& stem);

/// The output of `crt plugins`, as JSON.
std::string devicesJson();

}  // namespace crt
