/// The media around the camera: those of all bodies that contain its position and that absorb or have holes.
#pragma once

namespace crt {

/// Sets CrtScene::camera_media of a finished blob from the surfaces of the scene and the position of the
/// camera (for a lens, its centre). Rays in seven directions count their crossings in double precision.
/// Where they disagree, a body is not closed or bodies overlap: then the majority counts, and a warning
/// says so.
void findCameraMedia(unsigned char* blob);

}  // namespace crt
