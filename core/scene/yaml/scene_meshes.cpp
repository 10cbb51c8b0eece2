#include "scene/yaml/scene_meshes.h"

#include "base/log.h"
#include "base/vec3d.h"

#include <fmt/format.h>

#include <string_view>

namespace crt {
namespace {

/// Triples in a list of lists.
std::optional<std::vector<Vec3d>> readPoints(const SectionReader& mesh, std::string_view key,
                                             const char* one) {
    const YamlNode* list = mesh.list(key);
    if (list == nullptr) return std::nullopt;
    const KeySchema& row = *mesh.schema().find(key);
    std::vector<Vec3d> points;
    points.reserve(list->items.size());
    bool good = true;
    std::vector<double> values;
    for (std::size_t i = 0; i < list->items.size(); ++i) {
        const YamlNode& item = *list->items[i];
        good &= readNumbers(mesh.diagnostics(), item, item.place, row, fmt::format("{} {}", one, i), values);
        if (good) points.push_back({values[0], values[1], values[2]});
    }
    if (!good) return std::nullopt;
    return points;
}

}  // namespace

void SceneRoom::require(const YamlPlace& place, Diagnostics& out) const {
    std::string why = limit.refusal(placements, "placements", kBytesPerPlacement);
    if (why.empty()) why = limit.refusal(triangles, "triangles", kBytesPerTriangle);
    if (why.empty()) return;
    out.error(place, why);
    out.throwIfFailed();
}

std::optional<std::uint32_t> MeshReader::read(const SectionReader& section,
                                              const std::string& material_name, Object& object) {
    if ((section.has("obj") || section.has("ply") || section.has("stl")) && !section.has("mesh"))
        return readMeshFile(section, readMeshUse(section, material_name));
    if (section.has("gltf")) return readGltf(section);
    if (hasShape(section)) {
        const std::optional<std::uint32_t> mesh = readShape(section, object);
        refuseMeshKeys(section);
        return mesh;
    }
    const std::optional<SectionReader> written =
        section.section("mesh", fmt::format("the mesh of {}", section.subject()));
    if (!written) return std::nullopt;
    const NormalsUse normals = readNormals(section);
    const auto [known, fresh] = written_.try_emplace({section.find("mesh")->value.get(), normals});
    if (fresh) known->second = readWritten(*written, normals);
    refuseObjKeys(section);
    if (section.has("vertex_colors"))
        section.error("vertex_colors", "this key needs colours from a PLY",
                      "a 'mesh' has its own 'color_space'");
    return known->second;
}

std::optional<std::uint32_t> MeshReader::readWritten(const SectionReader& section,
                                                       const NormalsUse& normals_use) {
    std::optional<std::vector<Vec3d>> positions = readPoints(section, "positions", "position");
    std::optional<std::vector<Vec3d>> normals = readPoints(section, "normals", "normal");
    const YamlNode* faces = section.list("faces");
    if (!positions || faces == nullptr) return std::nullopt;

    Mesh mesh;
    mesh.positions = *std::move(positions);
    const std::size_t errors_before = out_.count();
    if (section.has("normals") && normals) {
        if (normals->size() != mesh.positions.size())
            section.error("normals", fmt::format("there are {} normals for {} positions", normals->size(),
                                                 mesh.positions.size()));
        for (std::size_t i = 0; i < normals->size(); ++i)
            if ((*normals)[i] == Vec3d{})
                out_.error(section.list("normals")->items[i]->place,
                           fmt::format("normal {} has length 0", i));
        mesh.normals = *std::move(normals);
    }
    readAttributes(section, mesh);
    if (faces->items.empty()) section.error("faces", "a mesh without faces cannot be seen");

    const KeySchema& row = *section.schema().find("faces");
    std::uint64_t dropped = 0;
    std::vector<std::uint32_t> polygon;
    std::vector<Vec3d> areas;  // Twice the area of each triangle of the fan, along its normal.
    for (std::size_t f = 0; f < faces->items.size(); ++f) {
        const YamlNode& face = *faces->items[f];
        if (face.kind != YamlKind::List || face.items.size() < 3) {
            expected(out_, face.place, "a list of 3 or more indices", fmt::format("face {}", f), face);
            continue;
        }
        polygon.clear();
        for (const YamlNodePtr& item : face.items) {
            std::int64_t index = 0;
            if (!readScalar(out_, *item, item->place, row, fmt::format("an index of face {}", f), index))
                continue;
            if (static_cast<std::uint64_t>(index) < mesh.positions.size())
                polygon.push_back(static_cast<std::uint32_t>(index));
            else
                out_.error(item->place,
                           fmt::format("face {} uses position {}, but there are only {} (counted from 0)",
                                       f, index, mesh.positions.size()));
        }
        if (polygon.size() != face.items.size()) continue;
        room_.triangles += polygon.size() - 2;
        room_.require(face.place, out_);

        // A fan from the first corner. A triangle that turns against the whole lies outside the polygon.
        const Vec3d& apex = mesh.positions[polygon[0]];
        areas.clear();
        Vec3d sum{};
        for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
            areas.push_back(cross(mesh.positions[polygon[i]] - apex, mesh.positions[polygon[i + 1]] - apex));
            sum = sum + areas.back();
        }
        constexpr double kRounding = 1e-9;
        for (std::size_t i = 0; i < areas.size(); ++i) {
            if (areas[i] == Vec3d{}) {
                ++dropped;
                continue;
            }
            if (dot(areas[i], sum) < -kRounding * dot(sum, sum)) {
                out_.error(face.place,
                           fmt::format("face {} is not convex; split it into convex polygons", f));
                break;
            }
            mesh.triangles.push_back({polygon[0], polygon[i + 1], polygon[i + 2]});
        }
    }
    if (out_.count() != errors_before) return std::nullopt;
    if (dropped > 0) {
        logWarning("{}: {} triangles of {} without area were left out",
                   section.place("faces").resolved().text(), dropped, section.subject());
    }
    if (!mesh.normals.empty()) mesh.normal_index = mesh.triangles;
    if (!mesh.uvs.empty()) mesh.uv_index = mesh.triangles;
    setNormals(mesh, normals_use, section.subject());
    scene_.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(scene_.meshes.size() - 1);
}

}  // namespace crt
