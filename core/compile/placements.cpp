#include "compile/placements.h"

#include "compile/instances.h"

#include <cmath>

namespace crt {
namespace {

/// Objects with more triangles than this are instanced by default. Below, rays are faster among triangles.
constexpr std::uint64_t kSharedFrom = std::uint64_t{1} << 22;

/// Rows of the cofactor matrix of the linear part: transforms normals, and its sign is that of the
/// determinant.
Matrix3d cofactors(const Matrix4d& m) {
    const Vec3d a{m[0], m[1], m[2]}, b{m[4], m[5], m[6]}, c{m[8], m[9], m[10]};
    return {cross(b, c), cross(c, a), cross(a, b)};
}

Placement placementOf(const Mesh& mesh, const Object& object, const Matrix4d& transform, std::size_t first,
                      std::uint32_t number) {
    const Matrix3d normal_matrix = cofactors(transform);
    const Vec3d first_row{transform[0], transform[1], transform[2]};
    return {&object, &mesh, transform, normal_matrix, dot(first_row, normal_matrix[0]) < 0, first, number};
}

}  // namespace

Vec3d transformPoint(const Matrix4d& m, const Vec3d& p) {
    return {m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3], m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
            m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]};
}

std::array<Vec3d, 3> Placement::corners(std::size_t triangle) const {
    std::array<Vec3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k)
        p[k] = transformPoint(transform, mesh->positions[mesh->triangles[triangle][from(k)]]);
    return p;
}

std::optional<std::array<Vec3d, 3>> Placement::normals(std::size_t triangle) const {
    if (!hasNormals(triangle)) return std::nullopt;
    std::array<Vec3d, 3> normals;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d n = multiply(normal_matrix, mesh->normals[mesh->normal_index[triangle][from(k)]]);
        normals[k] = n * ((mirrored ? -1.0 : 1.0) / length(n));
    }
    return normals;
}

bool Placement::hasNormals(std::size_t triangle) const {
    if (mesh->normal_index.empty()) return false;
    for (const std::uint32_t index : mesh->normal_index[triangle]) {
        if (index == kNoNormal) return false;
        const Vec3d n = multiply(normal_matrix, mesh->normals[index]);
        const double squared = dot(n, n);
        if (!(squared > 0) || !std::isfinite(squared)) return false;
    }
    return true;
}

std::uint64_t trianglesOf(const Scene& scene, const Object& object) {
    return std::uint64_t{scene.meshes[object.mesh].triangles.size()} * object.transforms.size();
}

bool emits(const Scene& scene, const Object& object) {
    const std::size_t triangles = scene.meshes[object.mesh].triangles.size();
    for (std::size_t i = 0; i < triangles; ++i)
        if (emissionIndexOf(scene, object, i) >= 0) return true;
    return false;
}

bool sharesMesh(const Scene& scene, const Object& object) {
    const bool traced = tracesSurfaces(scene.integrator.type) &&
                        (scene.integrator.accelerator == Accelerator::Auto ||
                         scene.integrator.accelerator == Accelerator::Bvh);
    const std::size_t triangles = scene.meshes[object.mesh].triangles.size();
    if (!traced || object.sharing == Sharing::Never || object.shape || triangles == 0) return false;
    if (object.sharing == Sharing::Auto &&
        (object.transforms.size() < 2 || trianglesOf(scene, object) <= kSharedFrom))
        return false;
    return !emits(scene, object);
}

std::vector<Placement> placementsOf(const Scene& scene, std::optional<std::size_t> only,
                                    const DividedMeshes& divided) {
    const auto mesh_of = [&](const Object& object) -> const Mesh& {
        const auto own = divided.find(&object);
        return own != divided.end() ? own->second : scene.meshes[object.mesh];
    };
    if (only) return {placementOf(mesh_of(scene.objects[*only]), scene.objects[*only], kIdentity4d, 0, 0)};
    std::vector<Placement> placements;
    std::size_t first = 0;
    std::uint32_t number = 0;
    for (const Object& object : scene.objects) {
        const bool shared = sharesMesh(scene, object);
        for (const Matrix4d& transform : object.transforms) {
            if (!shared || !canInstance(transform)) {
                placements.push_back(placementOf(mesh_of(object), object, transform, first, number));
                first += placements.back().mesh->triangles.size();
            }
            ++number;
        }
    }
    return placements;
}

}  // namespace crt
