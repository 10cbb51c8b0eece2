/// A film that no longer changes, which a render hands to the makers of images.
#pragma once

#include "film/error_estimate.h"
#include "film/film.h"
#include "scene/scene.h"
#include "view/camera_moves.h"
#include "view/primitive_names.h"

#include <cstdint>
#include <memory>

namespace crt {

/// A scene as it is seen: its camera is where hands have moved it.
struct SeenScene {
    std::shared_ptr<const Scene> read;  ///< As the file says.
    CameraPose pose;                    ///< The camera as the user has moved it.
    Camera camera;                      ///< The file's with that pose.
    std::shared_ptr<const PrimitiveNames> names;
    std::uint32_t width = 0, height = 0;  ///< Of the whole film's crop window.
    PathFacts paths;
};

struct Snapshot {
    std::shared_ptr<const SeenScene> seen;
    std::shared_ptr<const Film> film;
    unsigned divisor = 1;   ///< Of the size: of a preview more than 1.
    std::uint64_t run = 0;  ///< Number of the restart that it belongs to.
    bool complete = false;  ///< Has all the samples that are asked for.
    double seconds = 0;     ///< Of rendering, since the restart.
};

}  // namespace crt
