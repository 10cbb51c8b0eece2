/// A glTF file → the text of a scene.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/import/import_options.h"
#include "scene/import/scene_text.h"

#include <string>

namespace crt {

/// `file_name` is what the scene calls the file, `folder` where the scene is. Everything that is not in the
/// scene as it is in the file goes to `losses`. Throws crt::Error(Usage) for a variant that the file lacks.
std::string gltfScene(GltfFile& file, const std::string& file_name, const std::string& folder,
                      const ImportOptions& options, Losses& losses);

}  // namespace crt
