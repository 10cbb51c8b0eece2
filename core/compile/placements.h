/// Objects where their transforms place them, and which of them share their mesh (instances.h).
#pragma once

#include "base/vec3d.h"
#include "scene/scene.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace crt {

/// An object as one of its transforms places it.
struct Placement {
    const Object* object;
    const Mesh* mesh;
    Matrix4d transform;
    Matrix3d normal_matrix;
    /// A mirroring transform turns the order of vertices round; turning it back keeps the outside outside.
    bool mirrored;
    std::size_t first;     ///< Number of its first triangle in the scene.
    std::uint32_t number;  ///< Among all places of all objects.

    /// The corner of the mesh's triangle that is the k-th of the placed one.
    std::size_t from(std::size_t k) const { return mirrored && k > 0 ? 3 - k : k; }

    /// In the author's units, for a triangle of the mesh.
    std::array<Vec3d, 3> corners(std::size_t triangle) const;

    /// Unit normals at the corners; nothing where one of them is missing or has no direction.
    std::optional<std::array<Vec3d, 3>> normals(std::size_t triangle) const;
    bool hasNormals(std::size_t triangle) const;
};

/// Of all its places.
std::uint64_t trianglesOf(const Scene& scene, const Object& object);

/// True if any of its triangles does.
bool emits(const Scene& scene, const Object& object);

/// True if the object's places share one mesh. Emitting ones do not: each of their triangles is a separate
/// light.
bool sharesMesh(const Scene& scene, const Object& object);

/// In the author's units.
Vec3d transformPoint(const Matrix4d& m, const Vec3d& p);

/// Meshes that stand for those of the scene's objects (divide.h).
using DividedMeshes = std::map<const Object*, Mesh>;

/// Placements that become triangles: of the scene, or of one object alone, at its origin.
std::vector<Placement> placementsOf(const Scene& scene, std::optional<std::size_t> only,
                                    const DividedMeshes& divided = {});

/// Calls visit(number in the scene, placement, number in its mesh) for [first, end).
template <class Visit>
void forEachTriangle(const std::vector<Placement>& placements, std::size_t first, std::size_t end,
                     const Visit& visit) {
    auto placement =
        std::prev(std::upper_bound(placements.begin(), placements.end(), first,
                                   [](std::size_t i, const Placement& p) { return i < p.first; }));
    for (std::size_t i = first; i < end; ++i) {
        while (i - placement->first >= placement->mesh->triangles.size()) ++placement;
        visit(i, *placement, i - placement->first);
    }
}

}  // namespace crt
