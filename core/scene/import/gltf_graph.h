/// The nodes of a glTF file: what stands where.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/import/scene_text.h"
#include "scene/scene.h"

#include <vector>

namespace crt {

Vec3d pointAt(const Matrix4d& m, const Vec3d& point);
Vec3d directionAt(const Matrix4d& m, const Vec3d& direction);

/// True if the reader of scenes would refuse it: flat, or not finite.
bool flattens(const Matrix4d& m);

/// A mesh, camera or light of a node, and where it is in the world.
struct GltfPlaced {
    int node, what;
    Matrix4d world;
};

struct GltfGraph {
    std::vector<GltfPlaced> meshes, cameras, lights;
    std::vector<Matrix4d> world;  ///< By node.
};

/// Of the scene that the file shows. Nodes are a forest: throws crt::Error(Scene) for one that is met twice,
/// which is its own ancestor, or has two parents.
GltfGraph readGltfGraph(const GltfFile& file, Losses& losses);

/// The place of a mesh: with a skin, where its first joint takes it. In the pose in which it was bound every
/// joint takes it to the same place.
Matrix4d gltfBindPose(GltfFile& file, const GltfGraph& graph, const GltfPlaced& placed, Losses& losses);

}  // namespace crt
