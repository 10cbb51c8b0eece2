/// The part of MeshReader that reads objects with a shape: spheres, disks and cylinders, which stay what
/// they are, and rectangles and boxes, which become meshes.
#include "scene/yaml/scene_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {
namespace {

/// Adds a rectangle around `centre`, whose sides are 2·a and 2·b, with the normal a × b.
void addRectangle(Mesh& mesh, const Vec3d& centre, const Vec3d& a, const Vec3d& b) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    constexpr std::array<std::array<double, 2>, 4> kCorners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (const std::array<double, 2>& uv : kCorners) {
        mesh.positions.push_back(centre + a * (2 * uv[0] - 1) + b * (2 * uv[1] - 1));
        mesh.uvs.push_back(uv);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.uv_index = mesh.triangles;
}

Mesh rectangleMesh(const std::vector<double>& size) {
    Mesh mesh;
    addRectangle(mesh, {0, 0, 0}, {size[0] / 2, 0, 0}, {0, size[1] / 2, 0});
    return mesh;
}

Mesh boxMesh(const std::vector<double>& size) {
    const Vec3d x{size[0] / 2, 0, 0}, y{0, size[1] / 2, 0}, z{0, 0, size[2] / 2};
    Mesh mesh;
    addRectangle(mesh, z, x, y);
    addRectangle(mesh, z * -1, x * -1, y);
    addRectangle(mesh, x, z * -1, y);
    addRectangle(mesh, x * -1, z, y);
    addRectangle(mesh, y, x, z * -1);
    addRectangle(mesh, y * -1, x, z);
    return mesh;
}

Quadric readSphere(const SectionReader& section) {
    Quadric shape;
    section.read("radius", shape.radius);
    shape.from_z = -shape.radius;
    shape.to_z = shape.radius;
    section.read("from_z", shape.from_z);
    section.read("to_z", shape.to_z);
    section.read("inward", shape.inward);
    const bool ordered = shape.from_z < shape.to_z;
    if (!ordered)
        section.error("from_z", "nothing is left of the sphere: 'from_z' must be less than 'to_z'");
    if (ordered && (shape.to_z <= -shape.radius || shape.from_z >= shape.radius))
        section.error(shape.to_z <= -shape.radius ? "to_z" : "from_z",
                      fmt::format("nothing is left of the sphere: it goes from z = {:g} to {:g}",
                                  -shape.radius, shape.radius));
    return shape;
}

Quadric readDisk(const SectionReader& section) {
    Quadric shape;
    shape.type = QuadricType::Disk;
    shape.from_z = shape.to_z = 0;
    section.read("radius", shape.radius);
    return shape;
}

Quadric readCylinder(const SectionReader& section) {
    Quadric shape;
    shape.type = QuadricType::Cylinder;
    section.read("radius", shape.radius);
    section.read("from_z", shape.from_z);
    section.read("to_z", shape.to_z);
    section.read("inward", shape.inward);
    if (shape.from_z >= shape.to_z)
        section.error("from_z", "the cylinder has no length: 'from_z' must be less than 'to_z'");
    return shape;
}

constexpr std::array<const char*, 5> kShapeKeys{"sphere", "disk", "cylinder", "rectangle", "box"};

}  // namespace

bool MeshReader::hasShape(const SectionReader& object) {
    return std::any_of(kShapeKeys.begin(), kShapeKeys.end(),
                       [&](const char* key) { return object.has(key); });
}

std::optional<std::uint32_t> MeshReader::readShape(const SectionReader& section, Object& object) {
    Mesh mesh;  // empty: the object is a shape
    const std::size_t errors_before = out_.count();
    for (const std::string key : kShapeKeys) {
        const std::optional<SectionReader> own =
            section.section(key, fmt::format("the {} of {}", key, section.subject()));
        if (!own) continue;
        if (key == "sphere") object.shape = readSphere(*own);
        if (key == "disk") object.shape = readDisk(*own);
        if (key == "cylinder") object.shape = readCylinder(*own);
        if (key == "rectangle" || key == "box") {
            std::vector<double> size;
            if (!own->read("size", size)) continue;
            room_.triangles += 12;
            mesh = key == "box" ? boxMesh(size) : rectangleMesh(size);
        }
    }
    if (out_.count() != errors_before) return std::nullopt;
    if (object.shape)
        for (std::size_t i = 0; i < object.transforms.size(); ++i)
            if (!evenScaleOf(object.transforms[i])) {
                section.error(section.has("transform") ? "transform" : "transforms",
                              fmt::format("{} {}", wordOf(object.shape->type), kShapesStayShapes));
                break;
            }
    scene_.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(scene_.meshes.size() - 1);
}

}  // namespace crt
