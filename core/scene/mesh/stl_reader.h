/// STL files → Mesh.
#pragma once

#include "scene/mesh/mesh_io.h"

#include <string>

namespace crt {

/// Reads an STL, binary or ascii: triangles alone. Corners at the same place become one vertex; the normals
/// of the file, which say what the order of the corners says, are not read. Throws crt::Error(Scene), with
/// file:line in an ascii file, for one that is missing, has another format, is truncated, or has no
/// triangle. Triangles of vertices that are not finite, and those without area, are left out with a warning.
LoadedMesh loadStl(const std::string& path);

/// The same of a file's content.
LoadedMesh readStl(const std::string& content, const std::string& path);

}  // namespace crt
