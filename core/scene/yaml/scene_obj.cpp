/// The part of ObjectReader that reads objects with `obj`: which of their materials are the file's, and
/// which the scene's.
#include "scene/yaml/scene_objects.h"

#include "base/log.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace crt {

ObjectReader::Overrides ObjectReader::readOverrides(const SectionReader& object) {
    Overrides overrides;
    const YamlNode* map = object.map("material_overrides");
    if (map == nullptr) return overrides;
    for (const YamlEntry& entry : map->entries) {
        std::string name;
        if (!readText(out_, *entry.value, entry.place,
                      fmt::format("the material in place of '{}'", entry.key), name))
            continue;
        if (const std::optional<std::int32_t> index = findMaterial(name, entry.place, false))
            overrides[entry.key] = *index;
    }
    return overrides;
}

/// How an object wants its OBJ; `material` is the value of the key, empty where it is left out.
ObjectReader::ObjUse ObjectReader::readObjUse(const SectionReader& object, const std::string& material) {
    ObjUse use;
    if (material != "from_mtl") use.material = material;
    use.overrides = readOverrides(object);
    if (const std::optional<SectionReader> mtl =
            object.section("mtl", fmt::format("the mtl of {}", object.subject())))
        mtl->readEnum("color", use.options.color);
    bool replace_all = false;
    object.read("override", replace_all);
    if (!replace_all) return use;
    use.options.use_mtl = false;
    if (use.material.empty())
        object.error("override",
                     "there is nothing to put in place of the materials "
                     "of the OBJ; name a material with 'material:'");
    if (object.has("material_overrides"))
        object.error("material_overrides",
                     "'override: true' replaces all materials of the OBJ; none is left for this");
    return use;
}

/// Keys that only an object with `obj` may have.
void ObjectReader::refuseObjKeys(const SectionReader& object) const {
    if (object.has("material_overrides"))
        object.error("material_overrides", "only an OBJ has materials to override");
    if (object.has("override")) object.error("override", "only an OBJ has materials to override");
    if (object.has("mtl")) object.error("mtl", "only an OBJ has an MTL");
}

LoadedMesh* ObjectReader::load(const SectionReader& object, const std::string& path,
                               const ObjOptions& options) {
    const auto [file, fresh] = loaded_.try_emplace({path, options.use_mtl, options.color});
    if (fresh) {
        try {
            file->second = std::make_unique<LoadedMesh>(loadObj(path, options));
            for (const std::string& read : file->second->files) files_.note(read);
            addMaps(*file->second, path);
        } catch (const Error& e) {
            if (e.kind() == ErrorKind::Internal) throw;
            object.error("obj", sentenceWithPlace(e));
        }
    }
    return file->second.get();
}

std::optional<std::uint32_t> ObjectReader::readObj(const SectionReader& object, const ObjUse& use) {
    std::string name;
    if (!object.read("obj", name)) return std::nullopt;
    const std::optional<std::string> path = files_.locate(name, object.place("obj"), out_);
    if (!path) return std::nullopt;
    LoadedMesh* const loaded = load(object, *path, use.options);
    if (loaded == nullptr) return std::nullopt;
    checkOverrides(object, *loaded, use.overrides);

    // One mesh for all objects that ask for the same thing; an OBJ without materials is the same however
    // they are read.
    const bool materials = !loaded->materials.empty();
    const FileUse file{*path, materials, materials ? use.options.color : MtlColor::Linear};
    const auto [known, first] = meshes_.try_emplace({file, use.overrides});
    if (first) {
        known->second = static_cast<std::uint32_t>(scene_.meshes.size());
        scene_.meshes.push_back(withSceneMaterials(*loaded, known->second, *path, use.overrides));
    }
    checkMaterials(object, *loaded, scene_.meshes[known->second], use);
    return known->second;
}

/// The mesh of a file: moved out of it for the first mesh of the scene that wants it, a copy of that for
/// others.
Mesh ObjectReader::takeMesh(LoadedMesh& loaded, std::uint32_t number) {
    const auto [taken, first] = taken_.try_emplace(&loaded, TakenMesh{number, {}});
    if (first) {
        taken->second.material = loaded.mesh.material;
        return std::move(loaded.mesh);
    }
    Mesh mesh = scene_.meshes[taken->second.mesh];
    mesh.material = taken->second.material;
    mesh.emission.clear();
    return mesh;
}

/// The mesh, as number `mesh_number` of the scene, with its materials put into the scene, or those of
/// `overrides` in their place.
Mesh ObjectReader::withSceneMaterials(LoadedMesh& loaded, std::uint32_t mesh_number, const std::string& path,
                                      const Overrides& overrides) {
    const std::string file_name = std::filesystem::path(path).filename().string();
    std::vector<std::int32_t> material(loaded.materials.size(), -1), emission(loaded.materials.size(), -1);
    for (std::size_t i = 0; i < loaded.materials.size(); ++i) {
        const LoadedMaterial& own = loaded.materials[i];
        // A material that is replaced is replaced as a whole, so its glow (Ke) goes with it.
        if (const auto replaced = overrides.find(own.name); replaced != overrides.end()) {
            material[i] = replaced->second;
            continue;
        }
        if (!own.mtl) continue;
        material[i] = static_cast<std::int32_t>(scene_.materials.size());
        scene_.materials.push_back(own.mtl->material);
        scene_.materials.back().name = fmt::format("{}:{}", file_name, own.name);
        if (!own.mtl->emission) continue;
        emission[i] = static_cast<std::int32_t>(scene_.emissions.size());
        scene_.emissions.push_back(*own.mtl->emission);
    }
    Mesh mesh = takeMesh(loaded, mesh_number);
    const bool emits = std::any_of(emission.begin(), emission.end(), [](std::int32_t e) { return e >= 0; });
    for (std::int32_t& own : mesh.material) {
        const auto number = static_cast<std::size_t>(own);
        if (emits) mesh.emission.push_back(own < 0 ? -1 : emission[number]);
        if (own >= 0) own = material[number];
    }
    return mesh;
}

void ObjectReader::checkOverrides(const SectionReader& object, const LoadedMesh& loaded,
                                  const Overrides& overrides) {
    std::vector<std::string> names;
    for (const LoadedMaterial& m : loaded.materials) names.push_back(m.name);
    for (const auto& [name, index] : overrides) {
        if (std::find(names.begin(), names.end(), name) != names.end()) continue;
        const YamlEntry* entry = object.map("material_overrides")->find(name);
        out_.error(entry->key_place,
                   fmt::format("no face of '{}' has a material '{}'", object.find("obj")->value->text, name),
                   didYouMean(name, names));
    }
}

/// Every face must have a material: one of the OBJ's, or that of the object.
void ObjectReader::checkMaterials(const SectionReader& object, const LoadedMesh& loaded, const Mesh& mesh,
                                  const ObjUse& use) const {
    const std::size_t triangles = mesh.triangles.size();
    const auto bare = mesh.material.empty() ? static_cast<std::ptrdiff_t>(triangles)
                                            : std::count_if(mesh.material.begin(), mesh.material.end(),
                                                            [](std::int32_t m) { return m < 0; });
    if (!use.material.empty()) {
        if (bare > 0) return;
        const SourcePlace at = object.place("material").resolved();
        logInfo(
            "{}:{}:{}: {} has no face for material '{}': the OBJ gives each its own; 'override: true' "
            "replaces them all",
            at.file, at.line, at.column, object.subject(), use.material);
        return;
    }
    if (bare == 0) return;
    const std::string reason =
        loaded.missing_files.empty()
            ? ""
            : fmt::format(" (the OBJ names {}, which is not there)", inQuotes(loaded.missing_files.front()));
    object.error(
        object.has("material") ? "material" : "obj",
        fmt::format("{} of {} triangles of {} have no material{}; give them one with 'material: NAME'", bare,
                    triangles, object.subject(), reason),
        material_names_.empty()
            ? "for instance 'materials: {grey: {type: diffuse, reflectance: 0.5}}' and 'material: grey'"
            : fmt::format("for instance 'material: {}'", material_names_.front()));
}

}  // namespace crt
