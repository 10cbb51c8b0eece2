/// Triangle meshes, and the files that are written of them.
#pragma once

#include "vectors.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace crt::meshgen {

struct Mesh {
    std::vector<Vec> positions;
    std::vector<Vec> normals;  ///< One per position, or empty for flat faces.
    std::vector<std::array<std::uint8_t, 3>> colors;  ///< sRGB, one per position, or empty.
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Normal of a triangle, twice its area long.
Vec areaVector(const std::array<Vec, 3>& corner);
Vec areaVector(const Mesh& mesh, const std::array<std::uint32_t, 3>& t);

/// Stands the mesh on y = 0, centred in x and z, with height 1.
void normalise(Mesh& mesh);

/// Vertex normals as the average of the faces around, weighted by area.
void addNormals(Mesh& mesh);

/// Throws std::runtime_error where the file cannot be written.
void writeObj(const Mesh& mesh, const std::filesystem::path& path, const char* title);
/// Binary, little endian, in single precision. Throws as writeObj() does.
void writePly(const Mesh& mesh, const std::filesystem::path& path);

}  // namespace crt::meshgen
