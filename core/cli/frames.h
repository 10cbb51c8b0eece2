/// The values of a sequence that change from frame to frame, and the names of its files.
#pragma once

#include "scene/yaml/scene_yaml.h"

#include <cstdint>
#include <string>

namespace crt {

/// The frames `first`, `first` + `step`, … below `end`.
struct FrameRange {
    std::int64_t first = 0, end = 0, step = 1;

    std::int64_t count() const { return (end - first + step - 1) / step; }
};

/// Reads "0:24" or "0:240:10". Throws crt::Error(Usage).
FrameRange parseFrames(const std::string& text, const std::string& option);

/// The change as it is in a frame: each part of its value that has the word `frame`, outside quotes, is an
/// expression of muParser with the variables `frame` and `pi`, and becomes its number. "[cos(frame*pi/12),
/// 1, 3]" has one. Throws crt::Error(Usage) for what is no expression, or no finite number in this frame.
SceneOverride changeOfFrame(const SceneOverride& change, std::int64_t frame);

/// "out/####.png" of frame 7 → "out/0007.png". A name without '#' gets the number before its extension:
/// "turn.png" → "turn.0007.png". Standard output stays.
std::string fileOfFrame(const std::string& name, std::int64_t frame);

}  // namespace crt
