/// PLY files → Mesh.
#pragma once

#include "base/stage.h"
#include "scene/mesh/mesh_io.h"

#include <cstddef>
#include <string>
#include <string_view>

namespace crt {

/// Encoding of colours of vertices. ByType: integers sRGB-encoded, as scanners and modellers write them,
/// floats linear, as renderers do.
enum class PlyColor { Srgb, Linear, ByType };

struct PlyOptions {
    PlyColor color = PlyColor::ByType;
};

/// Reads a PLY: ascii, or binary of either order of bytes. Of vertices x, y, z, normals (nx, ny, nz),
/// texture coordinates (u, v; s, t; texture_u, texture_v) and colours (red, green, blue), in any order and
/// of any type; of faces vertex_indices, and texcoord (two for each corner, as MeshLab writes them). Throws
/// crt::Error(Scene) for a file that is missing, has another format, is not what its header says, whose
/// faces name vertices that are not there, or that has no face that can be seen. Errors that do not affect
/// the whole file are warnings, as for an OBJ; one line lists everything left out.
LoadedMesh loadPly(const std::string& path, const PlyOptions& options = {});

/// The same of a file's content, which is gone when this returns. `rows_at_a_time` changes nothing but what
/// a thread reads at a time.
LoadedMesh readPly(std::string content, const std::string& path, const PlyOptions& options, Stage& stage,
                   std::size_t rows_at_a_time);

}  // namespace crt
