/// The part of MeshReader that reads what meshes have at their vertices beside positions and normals, and
/// asks whether a mesh has what its materials need.
#include "scene/yaml/scene_meshes.h"

#include "base/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace crt {
namespace {

/// Requirements of a texture and of its parts on a mesh.
struct Needs {
    bool uvs = false, colors = false, opacity = false;
};

Needs needsOf(const Scene& scene, TextureIndex index) {
    Needs needs;
    std::set<TextureIndex> waiting{index};
    while (!waiting.empty()) {
        const TextureIndex next = *waiting.begin();
        waiting.erase(waiting.begin());
        if (next == kNoTexture) continue;
        const Texture& texture = scene.textures[static_cast<std::size_t>(next)];
        (texture.kind == Texture::Kind::VertexColors ? needs.colors
         : texture.of_opacity                        ? needs.opacity
                                                     : needs.uvs) = true;
        for (const TextureValue& value : texture.values) waiting.insert(value.texture);
        if (texture.factor) waiting.insert(texture.factor->texture);
    }
    return needs;
}

/// That of what it is made of, too.
Needs needsOf(const Scene& scene, const Material& material) {
    Needs needs;
    const auto add = [&](const Needs& more) {
        needs.uvs |= more.uvs;
        needs.colors |= more.colors;
        needs.opacity |= more.opacity;
    };
    for (const TextureIndex texture : material.textures()) add(needsOf(scene, texture));
    for (const std::int32_t part : material.parts)
        if (part >= 0) add(needsOf(scene, scene.materials[static_cast<std::size_t>(part)]));
    return needs;
}

/// Lists of numbers, one of them for each position. Nothing where the key is not there, or wrong.
std::vector<std::vector<double>> readPerVertex(const SectionReader& mesh, std::string_view key,
                                               const char* one, std::size_t positions) {
    const YamlNode* list = mesh.list(key);
    if (list == nullptr) return {};
    std::vector<std::vector<double>> all;
    all.reserve(list->items.size());
    const KeySchema& row = *mesh.schema().find(key);
    bool good = true;
    for (std::size_t i = 0; i < list->items.size(); ++i) {
        const YamlNode& item = *list->items[i];
        std::vector<double> values;
        good &= readNumbers(mesh.diagnostics(), item, item.place, row, fmt::format("{} {}", one, i), values);
        all.push_back(std::move(values));
    }
    if (good && all.size() != positions) {
        mesh.error(key, fmt::format("there are {} {} for {} positions", all.size(), key, positions));
        good = false;
    }
    return good ? all : std::vector<std::vector<double>>{};
}

}  // namespace

void MeshReader::readAttributes(const SectionReader& section, Mesh& mesh) const {
    const std::size_t positions = mesh.positions.size();
    for (const std::vector<double>& uv : readPerVertex(section, "uvs", "texture coordinates", positions))
        mesh.uvs.push_back({uv[0], uv[1]});
    bool linear = false;
    section.readEnum("color_space", linear);  // The choices are srgb and linear.
    for (const std::vector<double>& c : readPerVertex(section, "colors", "colour", positions)) {
        std::array<float, 3> color;
        for (std::size_t k = 0; k < 3; ++k)
            color[k] = static_cast<float>(linear ? c[k] : srgbToLinear(c[k]));
        mesh.colors.push_back(color);
    }
    if (section.has("color_space") && !section.has("colors"))
        section.error("color_space", "it needs 'colors'");
}

/// An image that emits needs a place on the mesh.
void MeshReader::checkEmission(const SectionReader& section, const Object& object, const Mesh& mesh) const {
    std::set<std::int32_t> emissions(mesh.emission.begin(), mesh.emission.end());
    emissions.insert(object.emission);
    emissions.erase(-1);
    for (const std::int32_t index : emissions) {
        if (scene_.emissions[static_cast<std::size_t>(index)].texture == kNoTexture) continue;
        if (object.shape)
            section.error("emission", "only a mesh can emit an image, not a sphere, disk or cylinder");
        else if (mesh.uvs.empty() || mesh.uvs_are_opacity)
            section.error("emission",
                          fmt::format("the emission is an image, but the mesh of {} has no texture "
                                      "coordinates",
                                      section.subject()),
                          section.has("mesh") ? "give the mesh 'uvs', one [u, v] for each position" : "");
    }
}

void MeshReader::checkTextures(const SectionReader& section, const Object& object) const {
    if (scene_.textures.empty()) return;
    const Mesh& mesh = scene_.meshes[object.mesh];  // Of a shape it is empty.
    checkEmission(section, object, mesh);
    std::set<std::int32_t> materials(mesh.material.begin(), mesh.material.end());
    if (mesh.material.empty() || materials.contains(-1)) materials.insert(object.material);
    materials.erase(-1);
    const std::string_view named = section.has("material") ? "material"
                                   : section.has("obj")    ? "obj"
                                   : section.has("ply")    ? "ply"
                                   : section.has("stl")    ? "stl"
                                                           : "mesh";
    for (const std::int32_t index : materials) {
        const Material& material = scene_.materials[static_cast<std::size_t>(index)];
        const Needs needs = needsOf(scene_, material);
        if (needs.opacity && !mesh.uvs_are_opacity)
            section.error(named,
                          fmt::format("material '{}' needs the opacity of vertices, but the mesh of {} has "
                                      "none",
                                      material.name, section.subject()),
                          section.has("gltf") ? "write 'vertex_opacity: true' in the gltf" : "");
        if (needs.uvs && mesh.uvs_are_opacity)
            section.error(named,
                          fmt::format("material '{}' has a texture, but the mesh of {} has opacities "
                                      "instead of texture coordinates",
                                      material.name, section.subject()));
        if (needs.uvs && mesh.uvs.empty() && !object.shape)
            section.error(named,
                          fmt::format("material '{}' has a texture, but the mesh of {} has no texture "
                                      "coordinates",
                                      material.name, section.subject()),
                          section.has("mesh") ? "give the mesh 'uvs', one [u, v] for each position" : "");
        if (needs.colors && mesh.colors.empty())
            section.error(named,
                          fmt::format("material '{}' needs colours of vertices, but the mesh of {} has none",
                                      material.name, section.subject()),
                          section.has("mesh") ? "give the mesh 'colors', one [r, g, b] for each position"
                          : section.has("obj")
                              ? "crt reads them from a PLY or from 'colors' of a 'mesh'"
                              : "");
    }
}

/// Triangles without texture coordinates have no place in an image: they get a material without images.
void keepImagesFromBareTriangles(LoadedMesh& loaded) {
    Mesh& mesh = loaded.mesh;
    if (mesh.uv_index.empty()) return;
    std::map<std::int32_t, std::int32_t> bare;
    for (std::size_t t = 0; t < mesh.material.size(); ++t) {
        if (mesh.uv_index[t][0] != kNoUv || mesh.material[t] < 0) continue;
        const std::int32_t material = mesh.material[t];
        const std::optional<MtlMaterial>& mtl = loaded.materials[static_cast<std::size_t>(material)].mtl;
        if (!mtl || !(mtl->map_kd || mtl->map_d || mtl->norm)) continue;
        const auto [at, added] =
            bare.emplace(material, static_cast<std::int32_t>(loaded.materials.size()));
        if (added) {
            LoadedMaterial copy = loaded.materials[static_cast<std::size_t>(material)];
            copy.name += " without vt";
            copy.mtl->material.name = copy.name;
            copy.mtl->map_kd.reset();
            copy.mtl->map_d.reset();
            copy.mtl->norm.reset();
            loaded.materials.push_back(std::move(copy));
        }
        mesh.material[t] = at->second;
    }
}

/// Images that the materials of an OBJ name take the place of what they stand for where they can be read;
/// else that stays, with a warning.
void MeshReader::addMaps(LoadedMesh& loaded, const std::string& path) {
    keepImagesFromBareTriangles(loaded);
    std::map<std::string_view, std::size_t> without_uvs;
    const auto add = [&](const std::optional<MtlMap>& map, std::string_view keyword, const TexelUse& use,
                         std::string_view instead, TextureIndex& into) {
        if (!map) return;
        if (loaded.mesh.uvs.empty()) {
            ++without_uvs[keyword];
            return;
        }
        try {
            into = textures_.addImage(map->file, use, map->transform,
                                      map->clamp ? TextureWrap::Clamp : TextureWrap::Repeat, map->place);
        } catch (const Error& e) {
            if (e.kind() == ErrorKind::Internal) throw;
            logWarning("{}: {}; {}", map->place.text(), e.what(), instead);
        }
    };
    for (LoadedMaterial& material : loaded.materials) {
        if (!material.mtl) continue;
        MtlMaterial& mtl = *material.mtl;
        add(mtl.map_kd, "map_Kd", {}, "crt uses Kd instead", mtl.material.reflectance_texture);
        add(mtl.map_d, "map_d", {.kind = TexelKind::Numbers, .channel = mtl.map_d ? mtl.map_d->channel : 0},
            "crt uses d instead", mtl.material.opacity_texture);
        add(mtl.norm, "norm", {.kind = TexelKind::Normals}, "left out", mtl.material.normal_texture);
    }
    for (const auto& [keyword, count] : without_uvs)
        logWarning("{}: {} of {} material{} left out: no face has texture coordinates (vt)", path,
                   keyword, count, count == 1 ? "" : "s");
}

}  // namespace crt
