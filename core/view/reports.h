/// What a page asks for once: a pixel, the image as a file, the devices.
#pragma once

#include "view/snapshot.h"

#include <cstdint>
#include <optional>
#include <string>

namespace crt {

/// Value, error, surface and spectrum of a pixel of the crop window, as JSON. Throws crt::Error(Usage) for
/// one outside it.
std::string pixelJson(const Snapshot& snapshot, std::uint32_t x, std::uint32_t y);

/// How far the surface is along the ray through a place of the crop window, (0, 0) to (1, 1); nothing where
/// there is none, or the film does not know.
std::optional<double> depthAt(const Snapshot& snapshot, double x, double y);

/// The bytes of an EXR file with the image and all that the film holds. Throws crt::Error(Usage) for a
/// preview, and crt::Error(Output).
std::string exrOf(const Snapshot& snapshot);

/// What `crt plugins` lists, as JSON.
std::string devicesJson();

}  // namespace crt
