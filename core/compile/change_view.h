/// A compiled scene from another side: what a viewer changes many times a second.
#pragma once

#include "compile/compile.h"
#include "scene/scene.h"

namespace crt {

/// Gives the compiled scene the camera and the film's size and crop window that `scene` has. All else of
/// `scene`, the number of replicates too (replicatesOf), must be as it was compiled; then the bytes are
/// those that compileScene() makes of it, but for the identity: `hash` is empty from now on; and where the
/// scene's centre depends on the camera (focus.h), for the last digits: the centre stays. Returns false, and
/// changes nothing, where only compileScene() can do it: when a lens comes or goes, when rays of the new
/// camera begin beyond the reach of the backend's own acceleration structure, or when the camera is too far
/// from such a centre. Throws as compileScene().
bool changeView(CompiledScene& compiled, const Scene& scene, const CompileOptions& options);

}  // namespace crt
