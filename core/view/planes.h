/// Film → eight-bit picture: the image as it is developed, or one of its other planes in colours that show
/// it.
#pragma once

#include "image/development.h"
#include "view/view_state.h"
#include "view/snapshot.h"

#include <optional>
#include <string>
#include <vector>

namespace crt {

/// Display settings of a film. No sample depends on it.
struct Display {
    std::optional<double> exposure_ev;  ///< Instead of the scene's.
    std::string white = "scene";  ///< "scene", "none", a light of the scene, an illuminant, or "5000 K".
    std::string plane = "image";  ///< planeNames().
    bool operator==(const Display&) const = default;
};

/// "image", "error", "albedo", …
const std::vector<std::string>& planeNames();
/// Bits of Aov that a film must hold for it.
std::uint32_t aovsOfPlane(const std::string& plane);

/// Those of them that only another film would hold.
std::uint32_t aovsLacking(const Film& film, const std::string& plane);

/// Possible values of Display::white besides temperatures.
std::vector<std::string> whiteNames(const Scene& scene);
/// The scene's development with what the display changes. Throws crt::Error(Usage) for a white that is none.
Development developmentFor(const Display& display, const Scene& scene);

/// Throws crt::Error(Usage) for a plane that the film does not hold.
Picture pictureOf(const Snapshot& snapshot, const Display& display);

}  // namespace crt
