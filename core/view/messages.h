/// What pages and the program say to each other, as JSON.
#pragma once

#include "view/board.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace crt {

/// What a page asks for. Lengths of gestures are parts of the image: (0, 0) is its upper left corner, (1, 1)
/// the lower right.
struct ViewChange {
    std::optional<std::array<double, 2>> orbit;  ///< To the right, upwards. Radians.
    std::optional<std::array<double, 2>> pan;    ///< To the right, upwards.
    std::optional<double> dolly;                 ///< Factor on the distance to the target.
    std::optional<std::array<double, 2>> focus;  ///< Where the surface is that shall be sharp.
    bool reset_camera = false;                   ///< To the scene's.
    std::optional<bool> paused;
    std::optional<std::uint64_t> samples;
    std::optional<double> exposure_ev;
    std::optional<std::string> white, plane, backend, device;
};

/// Throws crt::Error(Usage) for what is no JSON, for keys that there are not, and for values out of range.
ViewChange readChange(const std::string& text);

/// All of the status, and the picture's numbers without its pixels.
std::string sightJson(const Board::Sight& sight);

/// The moved keys of a scene's camera, as the scene file has them.
std::string cameraYaml(const CameraPose& pose, bool has_lens);

}  // namespace crt
