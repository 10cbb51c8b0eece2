/// Meshes that are stored once and placed many times (kernel/geometry/instances.h).
#pragma once

#include "compile/accelerator.h"
#include "compile/flatten.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

/// An instance in the author's units.
struct PlacedMesh {
    const Object* object = nullptr;
    Matrix4d transform = kIdentity4d;
    std::size_t mesh = 0;      ///< In FlatScene::meshes.
    std::uint32_t number = 0;  ///< Among the places of all objects.
    Vec3d lower{}, upper{};    ///< A box that holds it.
};

/// True if rays can be transformed back. Where it flattens the mesh, or nearly does, a place is written out
/// as triangles.
bool canInstance(const Matrix4d& transform);

/// `flat` is an object at its origin.
InstancedMesh instancedMesh(FlatScene flat);

/// Throws crt::Error(Scene) where the transform moves the mesh to infinity.
PlacedMesh placedMesh(const Object& object, const Matrix4d& transform, const InstancedMesh& mesh,
                      std::size_t mesh_number, std::uint32_t number);

/// The instance in a scene of this centre and scale.
FlatInstance flatInstance(const PlacedMesh& placed, const InstancedMesh& mesh, const Vec3d& centre,
                          int scale_exponent);

/// Fills in the triangles of the meshes, which are behind the slots; `all` are both.
void compileMeshTriangles(const FlatScene& flat, const MeshTrees& trees, std::span<kernel::CrtTriangle> all);

std::vector<kernel::CrtInstance> compileInstances(const FlatScene& flat, const MeshTrees& trees);

}  // namespace crt
