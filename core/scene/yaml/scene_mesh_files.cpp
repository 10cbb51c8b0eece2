/// The part of MeshReader that reads objects with `obj`, `ply` or `stl`: which of their materials are the
/// file's, and which the scene's.
#include "scene/yaml/scene_meshes.h"

#include "base/log.h"
#include "base/stage.h"
#include "scene/mesh/obj_text.h"
#include "scene/mesh/ply_reader.h"
#include "scene/mesh/stl_reader.h"
#include "scene/mesh/vertex_normals.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace crt {

/// Options of an object for the file of its mesh; `material` is the value of the key, empty where it is left
/// out.
MeshReader::MeshUse MeshReader::readMeshUse(const SectionReader& object, const std::string& material) {
    MeshUse use;
    use.file.format = object.has("ply")   ? MeshFormat::Ply
                      : object.has("stl") ? MeshFormat::Stl
                                          : MeshFormat::Obj;
    use.file.normals = readNormals(object);
    if (use.file.format == MeshFormat::Ply)
        object.readEnum("vertex_colors", use.file.colors);
    else if (object.has("vertex_colors"))
        object.error("vertex_colors", "this key needs colours from a PLY");
    if (use.file.format != MeshFormat::Obj) {
        refuseObjKeys(object);
        use.material = material;
        return use;
    }
    use.parts = readMeshParts(object);
    if (material != "from_mtl") use.material = material;
    if (const std::optional<SectionReader> mtl =
            object.section("mtl", fmt::format("the mtl of {}", object.subject())))
        mtl->readEnum("color", use.file.obj.color);
    bool replace_all = false;
    object.read("override", replace_all);
    if (!replace_all) return use;
    use.file.obj.use_mtl = false;
    if (use.material.empty())
        object.error("override",
                     "'override' needs a replacement for the materials of the OBJ; name one with "
                     "'material:'");
    return use;
}

/// Keys that only an object with `obj` may have.
void MeshReader::refuseObjKeys(const SectionReader& object) const {
    if (object.has("parts")) object.error("parts", "only an OBJ has parts that have names");
    if (object.has("override")) object.error("override", "only an OBJ has materials to override");
    if (object.has("mtl")) object.error("mtl", "only an OBJ has an MTL");
}

/// Keys that only an object with a mesh may have.
void MeshReader::refuseMeshKeys(const SectionReader& object) const {
    refuseObjKeys(object);
    for (const char* key : {"normals", "crease_angle_deg"})
        if (object.has(key)) object.error(key, "a shape already has normals");
    if (object.has("vertex_colors")) object.error("vertex_colors", "this key needs colours from a PLY");
}

MeshReader::NormalsUse MeshReader::readNormals(const SectionReader& object) const {
    NormalsUse use;
    object.readEnum("normals", use.source);
    object.read("crease_angle_deg", use.crease_angle_deg);
    if (use.source == NormalsUse::Source::Smooth) return use;
    if (object.has("crease_angle_deg"))
        object.error("crease_angle_deg", "only computed normals have creases",
                     "add 'normals: smooth'");
    return {.source = use.source};
}

void MeshReader::setNormals(Mesh& mesh, const NormalsUse& use, const std::string& subject) {
    if (use.source == NormalsUse::Source::File) return;
    mesh.normals = {};
    mesh.normal_index = {};
    if (use.source == NormalsUse::Source::Flat) return;
    const Stage stage(fmt::format("computing the normals of {}", subject));
    makeSmoothNormals(mesh, use.crease_angle_deg);
}

std::unique_ptr<LoadedMesh> MeshReader::takeOffered(const FileUse& use) {
    std::error_code unknown;
    const bool taken = offered_ && use.obj == ObjOptions{} && use.colors == PlyOptions{}.color &&
                       std::filesystem::equivalent(offered_->files.front(), use.path, unknown);
    return taken ? std::move(offered_) : nullptr;
}

LoadedMesh MeshReader::read(const FileUse& use) {
    switch (use.format) {
        case MeshFormat::Ply: return loadPly(use.path, PlyOptions{use.colors});
        case MeshFormat::Stl: return loadStl(use.path);
        case MeshFormat::Obj: break;
    }
    return loadObj(use.path, use.obj);
}

LoadedMesh* MeshReader::load(const SectionReader& object, const FileUse& use) {
    const auto [file, fresh] = loaded_.try_emplace(use);
    if (fresh) {
        try {
            file->second = takeOffered(use);
            if (!file->second) file->second = std::make_unique<LoadedMesh>(read(use));
            for (const std::string& read : file->second->files) files_.note(read);
            addMaps(*file->second, use.path);
            setNormals(file->second->mesh, use.normals, std::filesystem::path(use.path).filename().string());
        } catch (const Error& e) {
            if (e.kind() == ErrorKind::Internal) throw;
            file->second = nullptr;
            object.error(keyOf(use.format), sentenceWithPlace(e));
        }
    }
    return file->second.get();
}

std::optional<std::uint32_t> MeshReader::readMeshFile(const SectionReader& object, MeshUse use) {
    const std::string_view key = keyOf(use.file.format);
    std::string name;
    if (!object.read(key, name)) return std::nullopt;
    const std::optional<std::string> path = files_.locate(name, object.place(key), out_);
    if (!path) return std::nullopt;
    use.file.path = *path;
    LoadedMesh* const loaded = load(object, use.file);
    if (loaded == nullptr) return std::nullopt;

    // One mesh for all objects that ask for the same thing; an OBJ without materials is the same however
    // they are read.
    if (loaded->materials.empty()) use.file.obj = {.use_mtl = false, .color = MtlColor::Linear};
    const auto [known, first] = meshes_.try_emplace({use.file, use.parts});
    if (first) {
        known->second = static_cast<std::uint32_t>(scene_.meshes.size());
        scene_.meshes.push_back(withSceneMaterials(*loaded, known->second, object, use));
    }
    if (const Mesh& mesh = scene_.meshes[known->second]; !mesh.triangles.empty())
        checkMaterials(object, *loaded, mesh, use);
    return known->second;
}

/// The mesh of a file: moved out of it for the first mesh of the scene that wants it, a copy of that for
/// others.
Mesh MeshReader::takeMesh(LoadedMesh& loaded, std::uint32_t number) {
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

/// The mesh, as number `mesh_number` of the scene, with its materials put into the scene, or those of the
/// object's parts in their place.
Mesh MeshReader::withSceneMaterials(LoadedMesh& loaded, std::uint32_t mesh_number,
                                      const SectionReader& object, const MeshUse& use) {
    Mesh mesh = takeMesh(loaded, mesh_number);
    PartFinder parts(loaded, use.parts);
    if (!use.parts.empty()) {
        parts.lookAt(mesh);
        tellUnknownParts(object, parts);
    }

    const std::string file_name = std::filesystem::path(use.file.path).filename().string();
    std::vector<std::int32_t> material(loaded.materials.size(), -1), emission(loaded.materials.size(), -1);
    for (std::size_t i = 0; i < loaded.materials.size(); ++i) {
        const LoadedMaterial& own = loaded.materials[i];
        if (!own.mtl || !parts.keeps(i)) continue;
        material[i] = static_cast<std::int32_t>(scene_.materials.size());
        scene_.materials.push_back(own.mtl->material);
        scene_.materials.back().name = fmt::format("{}:{}", file_name, own.name);
        if (!own.mtl->emission) continue;
        emission[i] = static_cast<std::int32_t>(scene_.emissions.size());
        scene_.emissions.push_back(*own.mtl->emission);
    }

    const auto lights = [](std::int32_t e) { return e >= 0; };
    const bool emits = parts.anyEmission() || std::any_of(emission.begin(), emission.end(), lights);
    if (parts.anyMaterial() && mesh.material.empty()) mesh.material.assign(mesh.triangles.size(), -1);
    if (emits) mesh.emission.assign(mesh.triangles.size(), -1);
    if (mesh.material.empty() && !emits) return mesh;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::int32_t own = mesh.material.empty() ? -1 : mesh.material[t];
        const PartFinder::Found found = parts.find(own, t);
        // A material that is replaced is replaced as a whole, so its glow (Ke) goes with it.
        const bool keeps = own >= 0 && found.material < 0;
        if (!mesh.material.empty())
            mesh.material[t] = keeps ? material[static_cast<std::size_t>(own)] : found.material;
        if (emits)
            mesh.emission[t] = found.emission >= 0 ? found.emission
                               : keeps             ? emission[static_cast<std::size_t>(own)]
                                                   : -1;
    }
    return mesh;
}

/// Every face must have a material: one of the OBJ's, or that of the object.
void MeshReader::checkMaterials(const SectionReader& object, const LoadedMesh& loaded, const Mesh& mesh,
                                  const MeshUse& use) const {
    if (use.file.format != MeshFormat::Obj) return;  // That of the object, which must be there.
    const std::size_t triangles = mesh.triangles.size();
    const auto bare = mesh.material.empty() ? static_cast<std::ptrdiff_t>(triangles)
                                            : std::count_if(mesh.material.begin(), mesh.material.end(),
                                                            [](std::int32_t m) { return m < 0; });
    if (!use.material.empty()) {
        if (bare > 0) return;
        logInfo(
            "{}: {} has no face without a material, so '{}' is unused; 'override: true' replaces all "
            "materials of the OBJ",
            object.place("material").resolved().text(), object.subject(), use.material);
        return;
    }
    if (bare == 0) return;
    const std::vector<std::string>& names = materials_.names();
    const std::string reason =
        loaded.missing_files.empty()
            ? ""
            : fmt::format(" (the OBJ refers to {}, which does not exist)",
                          inQuotes(loaded.missing_files.front()));
    object.error(
        object.has("material") ? "material" : "obj",
        fmt::format("{} of {} triangles of {} have no material{}; give them one with 'material: NAME'", bare,
                    triangles, object.subject(), reason),
        names.empty()
            ? "for instance 'materials: {grey: {type: diffuse, reflectance: 0.5}}' and 'material: grey'"
            : fmt::format("for instance 'material: {}'", names.front()));
}

}  // namespace crt
