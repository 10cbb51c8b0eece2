#include "compile/change_view.h"

#include "base/vec3d.h"
#include "compile/accelerator.h"
#include "compile/camera_media.h"
#include "compile/settings.h"
#include "kernel/features.h"

namespace crt {

bool changeView(CompiledScene& compiled, const Scene& scene, const CompileOptions& options) {
    const bool has_lens = (compiled.header().features & CRT_FEATURE_LENS) != 0;
    if (has_lens != (scene.camera.aperture_radius > 0)) return false;
    if (compiled.without_nodes &&
        !backendFindsHits(scene.camera, compiled.centre, compiled.scale_exponent, options))
        return false;
    // Farther away the digits would be in the wrong place (focus.h).
    if (length(scene.camera.position - compiled.centre) > compiled.camera_reach) return false;
    kernel::CrtScene changed = compiled.header();
    compileView(scene, compiled.centre, compiled.scale_exponent, changed);
    compiled.header() = changed;
    findCameraMedia(compiled.data());
    compiled.hash.clear();
    return true;
}

}  // namespace crt
