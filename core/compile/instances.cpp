#include "compile/instances.h"

#include "base/error.h"
#include "base/vec3d.h"
#include "kernel/geometry/intersect.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace crt {
namespace {

/// Rows of x, y, z, 1.
using Affine = std::array<double, 12>;

Vec3d apply(const double* m, const Vec3d& p) {
    Vec3d out{};
    for (std::size_t k = 0; k < 3; ++k)
        out[k] = m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3];
    return out;
}

/// The box of a mesh as float has it, in its own coordinates.
std::array<Vec3d, 2> boxOf(const FlatScene& mesh) {
    std::array<Vec3d, 2> box{Vec3d{1, 1, 1}, Vec3d{-1, -1, -1}};
    for (const std::array<float, 9>& p : mesh.positions)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t v = 0; v < 3; ++v) {
                box[0][k] = std::min(box[0][k], static_cast<double>(p[3 * k + v]));
                box[1][k] = std::max(box[1][k], static_cast<double>(p[3 * k + v]));
            }
    return box;
}

/// A box that holds the mesh's box after a transform.
std::array<Vec3d, 2> movedBox(const double* m, const std::array<Vec3d, 2>& box) {
    std::array<Vec3d, 2> moved;
    for (std::size_t k = 0; k < 3; ++k) {
        moved[0][k] = moved[1][k] = m[4 * k + 3];
        for (std::size_t j = 0; j < 3; ++j) {
            const double a = m[4 * k + j] * box[0][j], b = m[4 * k + j] * box[1][j];
            moved[0][k] += std::min(a, b);
            moved[1][k] += std::max(a, b);
        }
    }
    return moved;
}

/// From the mesh's coordinates to the author's.
Affine fromMesh(const Matrix4d& transform, const FlatScene& mesh) {
    const double scale = std::ldexp(1.0, -mesh.scale_exponent);
    const Vec3d origin = apply(transform.data(), mesh.centre);
    Affine m{};
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t j = 0; j < 3; ++j) m[4 * k + j] = transform[4 * k + j] * scale;
        m[4 * k + 3] = origin[k];
    }
    return m;
}

Affine inverse(const Affine& m) {
    const Vec3d a{m[0], m[1], m[2]}, b{m[4], m[5], m[6]}, c{m[8], m[9], m[10]};
    const Vec3d ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
    const double scale = 1 / dot(a, bc);
    Affine out{};
    for (std::size_t k = 0; k < 3; ++k) {
        out[4 * k] = bc[k] * scale;
        out[4 * k + 1] = ca[k] * scale;
        out[4 * k + 2] = ab[k] * scale;
        out[4 * k + 3] = -(out[4 * k] * m[3] + out[4 * k + 1] * m[7] + out[4 * k + 2] * m[11]);
    }
    return out;
}

/// The largest sum of a row's absolute values, without the last; NaN where one is.
double rowNorm(const Affine& m) {
    double norm = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double sum = std::abs(m[4 * k]) + std::abs(m[4 * k + 1]) + std::abs(m[4 * k + 2]);
        if (!(sum <= norm)) norm = sum;  // NaN stays
    }
    return norm;
}

/// The margin of boxes around their contents, in the mesh's coordinates, for a ray from o: slack_per_length
/// · (|o.x| + |o.y| + |o.z|) + slack. A ray's origin is rounded by γ(5) of ‖to_mesh‖ (|o| + 1), its
/// direction by γ(4) of ‖to_mesh‖ times its length to the last point of the scene,
/// |o| + 2; corners of triangles in the scene by γ(4) of ‖to_world‖ and 1; and the triangle test
/// accepts what CRT_BOX_PADDING says. γ(16) covers each.
void setSlack(kernel::CrtInstance& record, const Affine& to_world, const Affine& to_mesh) {
    const double norm = rowNorm(to_mesh), rounding = static_cast<double>(CRT_GAMMA(16.0f));
    const double place = std::max({std::abs(to_world[3]), std::abs(to_world[7]), std::abs(to_world[11])});
    record.slack_per_length = static_cast<float>(norm * rounding);
    record.slack = static_cast<float>(
        norm * (rounding * (2 + rowNorm(to_world) + 2 * place) + 2 * static_cast<double>(CRT_BOX_PADDING)));
}

}  // namespace

bool canInstance(const Matrix4d& transform) {
    // Of the longest to the shortest axis, roughly. The slack of boxes is some 1e-6 of that.
    constexpr double kMostStretched = 1e4;
    Affine linear{};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t j = 0; j < 3; ++j) linear[4 * k + j] = transform[4 * k + j];
    return rowNorm(linear) * rowNorm(inverse(linear)) <= kMostStretched;  // NaN: false
}

InstancedMesh instancedMesh(FlatScene flat) {
    InstancedMesh mesh;
    mesh.box = boxOf(flat);
    mesh.flat = std::move(flat);
    return mesh;
}

PlacedMesh placedMesh(const Object& object, const Matrix4d& transform, const InstancedMesh& mesh,
                      std::size_t mesh_number, std::uint32_t number) {
    const Affine to_author = fromMesh(transform, mesh.flat);
    const std::array<Vec3d, 2> box = movedBox(to_author.data(), mesh.box);
    for (const Vec3d& corner : box)
        for (std::size_t k = 0; k < 3; ++k)
            if (!std::isfinite(corner[k]))
                throw Error(ErrorKind::Scene, "a transform moves a vertex beyond the range of single "
                                              "precision", object.place);
    return {&object, transform, mesh_number, number, box[0], box[1]};
}

FlatInstance flatInstance(const PlacedMesh& placed, const InstancedMesh& mesh, const Vec3d& centre,
                          int scale_exponent) {
    const double scale = std::ldexp(1.0, scale_exponent);
    Affine to_world = fromMesh(placed.transform, mesh.flat);
    FlatInstance instance;
    instance.mesh = placed.mesh;
    kernel::CrtInstance& record = instance.record;
    for (std::size_t k = 0; k < 3; ++k) {
        to_world[4 * k + 3] -= centre[k];
        for (std::size_t j = 0; j < 4; ++j) {
            record.to_world[4 * k + j] = static_cast<float>(to_world[4 * k + j] * scale);
            to_world[4 * k + j] = static_cast<double>(record.to_world[4 * k + j]);
        }
    }
    const Affine to_mesh = inverse(to_world);
    for (std::size_t i = 0; i < 12; ++i) record.to_mesh[i] = static_cast<float>(to_mesh[i]);
    setSlack(record, to_world, to_mesh);
    const Vec3d x{to_world[0], to_world[1], to_world[2]}, y{to_world[4], to_world[5], to_world[6]},
        z{to_world[8], to_world[9], to_world[10]};
    record.facing = dot(x, cross(y, z)) < 0 ? -1.0f : 1.0f;
    const std::array<Vec3d, 2> box = movedBox(to_world.data(), mesh.box);
    // Corners are rounded on their way, by less than this.
    const auto padding = static_cast<float>(CRT_GAMMA(8.0f) * (1 + rowNorm(to_world)));
    for (std::size_t k = 0; k < 3; ++k) {
        instance.box[3 * k] = instance.box[3 * k + 2] = static_cast<float>(box[0][k]) - padding;
        instance.box[3 * k + 1] = static_cast<float>(box[1][k]) + padding;
    }
    return instance;
}

void compileMeshTriangles(const FlatScene& flat, const MeshTrees& trees,
                          std::span<kernel::CrtTriangle> all) {
    std::size_t first = flat.triangles.size(), first_primitive = flat.firstInstance();
    for (std::size_t m = 0; m < flat.meshes.size(); ++m) {
        const FlatScene& mesh = flat.meshes[m].flat;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const std::uint32_t own = trees.orders[m][i];
            kernel::CrtTriangle& triangle = all[first + i];
            std::copy(mesh.positions[own].begin(), mesh.positions[own].end(), triangle.p);
            triangle.id = static_cast<std::uint32_t>(first_primitive) + own;
        }
        first += mesh.triangles.size();
        first_primitive += mesh.triangles.size();
    }
}

std::vector<kernel::CrtInstance> compileInstances(const FlatScene& flat, const MeshTrees& trees) {
    std::vector<std::uint32_t> first_primitive;
    auto next = static_cast<std::uint32_t>(flat.firstInstance());
    for (const InstancedMesh& mesh : flat.meshes) {
        first_primitive.push_back(next);
        next += static_cast<std::uint32_t>(mesh.flat.triangles.size());
    }
    std::vector<kernel::CrtInstance> records;
    auto id = static_cast<std::uint32_t>(flat.triangles.size());
    for (const FlatInstance& instance : flat.instances) {
        kernel::CrtInstance record = instance.record;
        record.root = trees.roots[instance.mesh];
        record.first_primitive = first_primitive[instance.mesh];
        record.first_id = id;
        id += static_cast<std::uint32_t>(flat.meshes[instance.mesh].flat.triangles.size());
        records.push_back(record);
    }
    return records;
}

}  // namespace crt
