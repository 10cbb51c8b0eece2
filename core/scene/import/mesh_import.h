/// A file of one mesh → the text of a scene.
#pragma once

#include "scene/import/scene_text.h"
#include "scene/mesh/mesh_io.h"

#include <string>

namespace crt {

/// `file_name` is what the scene calls the file.
std::string objScene(const LoadedMesh& loaded, const std::string& file_name, Losses& losses);
std::string plyScene(const Mesh& mesh, const std::string& file_name, Losses& losses);
std::string stlScene(const Mesh& mesh, const std::string& file_name, Losses& losses);

}  // namespace crt
