/// Normals at the vertices of a mesh, worked out from its faces.
#pragma once

#include "scene/scene.h"

#include <cstdint>
#include <vector>

namespace crt {

/// Puts normals in the place of those that the mesh has: at each corner the mean of the normals of the faces
/// around the vertex, weighted by the angles that they have there (Thürmer and Wüthrich 1998), so that how
/// a face is divided into triangles does not show. Faces count as one surface where they share an edge, run
/// along it in opposite directions, and their normals differ by at most `crease_angle_deg`; across other
/// edges the shading has a crease. Vertices at the same place are one. Where the normals cancel each other,
/// triangles are flat. Throws crt::Error(Scene) for more than 1.4 thousand million triangles.
void makeSmoothNormals(Mesh& mesh, double crease_angle_deg);

/// By vertex, the lowest with the same coordinates.
std::vector<std::uint32_t> verticesAtOnePlace(const std::vector<Vec3d>& positions);

}  // namespace crt
