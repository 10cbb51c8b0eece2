/// Models as scenes: a glTF, GLB, OBJ, PLY or STL file → the text of a scene that shows it. There is no
/// other way from such a file to a picture: `crt import` writes the text, and every command that takes a
/// scene reads it.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/import/import_options.h"
#include "scene/mesh/mesh_io.h"

#include <memory>
#include <string>

namespace crt {

/// With its dot, in lower case: ".obj".
std::string extensionOf(const std::string& path);
/// The ends of the names of models, for messages.
inline constexpr const char* kModelEnds = ".glb, .gltf, .obj, .ply and .stl";
/// By the end of the file's name, one of kModelEnds.
bool isModel(const std::string& path);
/// "Mitsuba" or "pbrt", by the end of the name of a scene of theirs; empty: it is none. crt's Python package
/// imports them.
std::string otherRendererOf(const std::string& path);
/// The command that converts such a scene.
std::string importHint(const std::string& path);
/// "Blender": what has files with this end that crt does not read, as far as they are known; else empty.
std::string unreadFormatOf(const std::string& path);

struct ImportedModel {
    std::string scene;                 ///< Its text.
    std::unique_ptr<LoadedMesh> mesh;  ///< For an OBJ, PLY or STL: hints for the reader of the scene.
};

/// The text of a scene of the model, with a camera and light where it has none. One warning reports
/// everything that was dropped or approximated, and so does a comment at the top. Throws crt::Error(Scene).
ImportedModel importModel(GltfFiles& files, const std::string& path, const ImportOptions& options = {});

}  // namespace crt
