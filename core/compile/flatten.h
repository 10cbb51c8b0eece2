/// Objects and transforms → one list of triangles, and lengths that single precision can hold
/// (docs/architecture.md, "Lengths").
#pragma once

#include "compile/focus.h"
#include "compile/placements.h"
#include "compile/shapes.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace crt {

/// One placed triangle, or shape.
struct FlatTriangle {
    std::int32_t material = -1;
    std::int32_t emission = -1;
    std::uint32_t object = 0;  ///< Number of the placement: an object has one for each of its transforms.
    bool smooth = false;
};

struct InstancedMesh;

/// A mesh in one of its places, of which flattening makes no triangles.
struct FlatInstance {
    kernel::CrtInstance record{};  ///< Matrices, slack and placement.
    std::size_t mesh = 0;          ///< In FlatScene::meshes.
    std::array<float, 9> box{};    ///< As in CrtTriangle.
};

/// All triangles of a scene, in the author's order; then all shapes, then all instances.
struct FlatScene {
    std::vector<FlatTriangle> triangles;
    std::vector<FlatShape> shapes;        ///< `triangles` from firstShape() on.
    std::vector<FlatInstance> instances;  ///< The last of `triangles`.
    std::vector<InstancedMesh> meshes;
    /// The object of the scene that this is, at its origin; nothing: all that are not instanced.
    std::optional<std::size_t> object;
    std::uint32_t placements = 0;
    /// x of the three vertices, y, z: centred, scaled, and rounded to single precision. Those of a triangle
    /// without area are one point; those of a shape its box, as in CrtTriangle.
    std::vector<std::array<float, 9>> positions;
    std::size_t smooth_triangles = 0;
    std::vector<kernel::CrtUvs> uvs;              ///< Of all triangles, where a texture or tangent asks.
    std::vector<kernel::CrtVertexColors> colors;  ///< Of all triangles, where a value asks for them.
    DividedMeshes divided;                        ///< Meshes that replace those of the scene.
    std::optional<Focus> focus;                   ///< If empty, the centre is the middle of the scene.
    Vec3d centre{};                               ///< In the author's units.
    int scale_exponent = 0;  ///< Lengths were multiplied by 2^scale_exponent after centring.

    /// Number of the first shape: how many triangles there are.
    std::size_t firstShape() const { return triangles.size() - shapes.size() - instances.size(); }
    std::size_t firstInstance() const { return triangles.size() - instances.size(); }
};

/// An object whose mesh is stored once, in its own coordinates, within ±1.
struct InstancedMesh {
    FlatScene flat;
    std::array<Vec3d, 2> box{};  ///< Lower and upper corner, of what float has.
};

/// Warns about triangles without area. Throws crt::Error(Scene) when there are too many triangles, or a
/// transform moves a vertex to infinity or changes the form of a shape.
FlatScene flattenScene(const Scene& scene);

/// Fills in those of the smooth triangles, in their order. They are computed from the scene again: stored
/// next to the blob they would be a third of the memory that a smooth mesh takes.
void flattenNormals(const Scene& scene, const FlatScene& flat, std::span<kernel::CrtNormals> normals);

}  // namespace crt
