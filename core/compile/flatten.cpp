#include "compile/flatten.h"

#include "base/error.h"
#include "base/log.h"
#include "base/stage.h"
#include "base/vec3d.h"
#include "scene/scene_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt {
namespace {

constexpr std::size_t kMostTriangles = std::size_t{1} << 28;

Vec3d transformPoint(const Matrix4d& m, const Vec3d& p) {
    return {m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3], m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
            m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]};
}

/// Rows of the cofactor matrix of the linear part: transforms normals, and its sign is that of the
/// determinant.
Matrix3d cofactors(const Matrix4d& m) {
    const Vec3d a{m[0], m[1], m[2]}, b{m[4], m[5], m[6]}, c{m[8], m[9], m[10]};
    return {cross(b, c), cross(c, a), cross(a, b)};
}

/// Appends the mesh of an object as one of its transforms places it.
void place(const Object& object, const Mesh& mesh, const Matrix4d& transform, FlatScene& flat,
           Stage& stage) {
    const Matrix3d normal_matrix = cofactors(transform);
    const Vec3d first_row{transform[0], transform[1], transform[2]};
    // A mirroring transform turns the order of vertices round; turning it back keeps the outside outside.
    const bool mirrored = dot(first_row, normal_matrix[0]) < 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        FlatTriangle t;
        t.object = flat.placements;
        t.material = !mesh.material.empty() && mesh.material[i] >= 0 ? mesh.material[i] : object.material;
        t.emission = !mesh.emission.empty() && mesh.emission[i] >= 0 ? mesh.emission[i] : object.emission;
        t.smooth = !mesh.normal_index.empty() &&
                   std::all_of(mesh.normal_index[i].begin(), mesh.normal_index[i].end(),
                               [](std::uint32_t n) { return n != kNoNormal; });
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t from = mirrored && k > 0 ? 3 - k : k;
            t.positions[k] = transformPoint(transform, mesh.positions[mesh.triangles[i][from]]);
            if (!std::all_of(t.positions[k].begin(), t.positions[k].end(),
                             [](double x) { return std::isfinite(x); }))
                throw Error(ErrorKind::Scene, "a transform moves a vertex to infinity", object.place);
            if (t.smooth) {
                const Vec3d n = multiply(normal_matrix, mesh.normals[mesh.normal_index[i][from]]);
                const double norm = length(n);
                if (norm > 0 && std::isfinite(norm))
                    t.normals[k] = n * ((mirrored ? -1.0 : 1.0) / norm);
                else
                    t.smooth = false;
            }
        }
        flat.triangles.push_back(t);
        stage.at(static_cast<double>(flat.triangles.size()));
    }
    ++flat.placements;
}

/// Sets centre and scale by the bounding box of the triangles that are `seen`.
void measure(FlatScene& flat, const std::vector<bool>& seen) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    Vec3d lower{inf, inf, inf}, upper{-inf, -inf, -inf};
    for (std::size_t i = 0; i < flat.triangles.size(); ++i) {
        if (!seen[i]) continue;
        for (const Vec3d& p : flat.triangles[i].positions)
            for (std::size_t k = 0; k < 3; ++k) {
                lower[k] = std::min(lower[k], p[k]);
                upper[k] = std::max(upper[k], p[k]);
            }
    }
    flat.centre = {};
    flat.scale_exponent = 0;
    double half_extent = 0;
    for (std::size_t k = 0; k < 3 && lower[k] <= upper[k]; ++k) {
        flat.centre[k] = lower[k] + (upper[k] - lower[k]) / 2;
        half_extent = std::max(half_extent, (upper[k] - lower[k]) / 2);
    }
    if (half_extent > 0) {
        int exponent = 0;
        std::frexp(half_extent, &exponent);
        flat.scale_exponent = -exponent;  // half_extent · 2^-exponent is in [½, 1)
    }
}

/// Corners of a triangle, centred and scaled.
std::array<Vec3d, 3> normalised(const FlatScene& flat, const FlatTriangle& triangle) {
    const double scale = std::ldexp(1.0, flat.scale_exponent);
    std::array<Vec3d, 3> p;
    for (std::size_t v = 0; v < 3; ++v) p[v] = (triangle.positions[v] - flat.centre) * scale;
    return p;
}

/// Coordinates within ±1. Higher over its edges than rounding in double makes three points of a line.
bool hasArea(const std::array<Vec3d, 3>& p) {
    const Vec3d a = p[1] - p[0], b = p[2] - p[0], n = cross(a, b);
    return dot(n, n) > 1e-30 * std::max(dot(a, a), dot(b, b));
}

/// Centre and power-of-two scale in double, so that far-away and huge or tiny scenes lose nothing in float,
/// and moving or scaling a scene by representable amounts gives the same bits. Triangles without area have
/// no part in it: nobody sees them.
void normaliseLengths(FlatScene& flat) {
    const std::size_t count = flat.triangles.size();
    std::vector<bool> seen(count, true);
    measure(flat, seen);
    std::uint64_t without_area = 0;
    for (std::size_t i = 0; i < count; ++i) {
        seen[i] = hasArea(normalised(flat, flat.triangles[i]));
        without_area += seen[i] ? 0 : 1;
    }
    if (without_area > 0) {
        logWarning("{} triangle{} no area and will not be seen", without_area,
                   without_area == 1 ? " has" : "s have");
        if (without_area < count) measure(flat, seen);
    }
    flat.positions.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::array<Vec3d, 3> p = normalised(flat, flat.triangles[i]);
        // Rounded to float, three points of one line make a sliver that can be hit; one point cannot.
        if (!seen[i]) p[0] = p[1] = p[2] = {};
        for (std::size_t v = 0; v < 3; ++v)
            for (std::size_t k = 0; k < 3; ++k) flat.positions[i][3 * k + v] = static_cast<float>(p[v][k]);
    }
}

}  // namespace

FlatScene flattenScene(const Scene& scene) {
    // Before anything is written out.
    std::uint64_t count = 0;
    for (const Object& object : scene.objects)
        count += std::uint64_t{scene.meshes[object.mesh].triangles.size()} * object.transforms.size();
    if (count >= kMostTriangles)
        throw Error(
            ErrorKind::Scene,
            fmt::format("written out, the scene has {} triangles; crt renders up to 268 million", count));
    if (scene.input_bytes > 0)
        if (const std::string why =
                ExpansionLimit(scene.input_bytes).refusal(count, "triangles", kBytesPerTriangle);
            !why.empty())
            throw Error(ErrorKind::Scene, fmt::format("{}: error: {}", scene.file, why), {scene.file});

    FlatScene flat;
    flat.triangles.reserve(count);
    Stage stage("placing triangles", static_cast<double>(count));
    for (const Object& object : scene.objects)
        for (const Matrix4d& transform : object.transforms)
            place(object, scene.meshes[object.mesh], transform, flat, stage);
    normaliseLengths(flat);
    return flat;
}

}  // namespace crt
