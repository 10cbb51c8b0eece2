/// Messages between pages and the program, as JSON.
#pragma once

#include "view/view_state.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// The changes in one request of a page: all of them are applied or, if one is refused, none. Lengths of
/// gestures are parts of the image: (0, 0) is its upper left corner, (1, 1) the lower right.
struct ViewChange {
    std::optional<std::array<double, 2>> orbit;  ///< To the right, upwards. Radians.
    std::optional<std::array<double, 2>> pan;    ///< To the right, upwards.
    std::optional<double> dolly;                 ///< Factor on the distance to the target.
    std::optional<std::array<double, 2>> focus;  ///< Place of the surface that shall be in focus.
    std::optional<double> fov_deg;               ///< As of fovOf_deg().
    std::optional<double> zoom;                  ///< Factor on the size of the image.
    bool reset_camera = false;                   ///< To the scene's.
    bool toggle_paused = false;
    std::optional<bool> paused;
    std::optional<std::uint64_t> samples;
    std::optional<double> exposure_ev;
    std::optional<double> exposure_step;  ///< Stops to add.
    std::optional<std::string> white, plane, backend, device;
};

/// The changes of a request, in order. One that cannot be read leaves the others as they are.
struct RequestedChange {
    ViewChange change;
    std::string refusal;  ///< Errors of the scene; empty: none.
};

/// An object is one change, a list several. Throws crt::Error(Usage) for text that is neither. A change is
/// refused for unknown keys and for values out of range.
std::vector<RequestedChange> readChanges(const std::string& text);

/// All of the status, and the picture's numbers without its pixels.
std::string stateJson(const ViewState::Copy& copy);

/// The moved keys of a scene's camera, as the scene file has them; the angle only with `has_fov`.
std::string cameraYaml(const CameraPose& pose, bool has_lens, bool has_fov);

}  // namespace crt
