/// The media around the camera: those of all bodies that contain its position and that absorb or have holes.
#pragma once

namespace crt {

/// Sets CrtScene::camera_media of a finished blob, from the scene's surfaces and the camera's position (of a
/// lens, its middle): what light enters and leaves on its way from outside to there. Rays in seven
/// directions count their crossings in double; where they do not agree, a body is not closed, and the
/// majority counts, with a warning.
void findCameraMedia(unsigned char* blob);

}  // namespace crt
