/// The geometry of objects: meshes of files and of the scene's text, and shapes.
#pragma once

#include "scene/gltf/gltf_mesh.h"
#include "scene/mesh/mesh_io.h"
#include "scene/mesh/mesh_parts.h"
#include "scene/mesh/ply_reader.h"
#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_materials.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace crt {

/// Counts of what the text of a scene may multiply, and their limits.
struct SceneRoom {
    ExpansionLimit limit;
    std::uint64_t placements = 0, triangles = 0;

    /// Stops when it is too large to be written out.
    void require(const YamlPlace& place, Diagnostics& out) const;
};

class MeshReader {
public:
    MeshReader(Diagnostics& out, SceneFiles& files, TextureReader& textures, GltfFiles& gltf,
               MaterialReader& materials, SceneRoom& room, Scene& scene)
        : out_(out),
          files_(files),
          textures_(textures),
          gltf_(gltf),
          materials_(materials),
          room_(room),
          scene_(scene) {}

    /// A file that was read already, with default options: whichever object names it takes it.
    void offer(std::unique_ptr<LoadedMesh> mesh) { offered_ = std::move(mesh); }
    /// Index of the mesh of an object, or of the empty one of a shape. `material_name` is the value of the
    /// key, empty where it is left out. Nothing if it is invalid, which is reported.
    std::optional<std::uint32_t> read(const SectionReader& object, const std::string& material_name,
                                      Object& into);
    /// Refuses a mesh that lacks what its materials need.
    void checkTextures(const SectionReader& section, const Object& object) const;
    void checkEmission(const SectionReader& section, const Object& object, const Mesh& mesh) const;
    /// Warns of triangles that were left out.
    void finish() const;

private:
    /// Source of the normals of an object's mesh.
    struct NormalsUse {
        enum class Source { File, Smooth, Flat } source = Source::File;
        double crease_angle_deg = 60;
        auto operator<=>(const NormalsUse&) const = default;
    };

    enum class MeshFormat { Obj, Ply, Stl };

    /// A file of a mesh, and how it is read.
    struct FileUse {
        std::string path;
        MeshFormat format = MeshFormat::Obj;
        ObjOptions obj;                      ///< Of an OBJ.
        PlyColor colors = PlyColor::ByType;  ///< Of a PLY.
        NormalsUse normals;
        auto operator<=>(const FileUse&) const = default;
    };

    /// Options of an object for its file.
    struct MeshUse {
        FileUse file;
        std::vector<PartUse> parts;
        std::string material;  ///< For the faces that have none; empty: there must be no such faces.
    };

    MeshUse readMeshUse(const SectionReader& object, const std::string& material);
    void refuseObjKeys(const SectionReader& object) const;
    void refuseMeshKeys(const SectionReader& object) const;
    NormalsUse readNormals(const SectionReader& object) const;
    static void setNormals(Mesh& mesh, const NormalsUse& use, const std::string& subject);
    std::vector<PartUse> readMeshParts(const SectionReader& object);
    void tellUnknownParts(const SectionReader& object, const PartFinder& parts) const;
    LoadedMesh* load(const SectionReader& object, const FileUse& use);
    std::unique_ptr<LoadedMesh> takeOffered(const FileUse& use);
    std::optional<std::uint32_t> readMeshFile(const SectionReader& object, MeshUse use);
    static LoadedMesh read(const FileUse& use);
    static std::string_view keyOf(MeshFormat format) {
        return format == MeshFormat::Ply ? "ply" : format == MeshFormat::Stl ? "stl" : "obj";
    }
    static bool hasShape(const SectionReader& object);
    std::optional<std::uint32_t> readShape(const SectionReader& section, Object& object);
    Mesh takeMesh(LoadedMesh& loaded, std::uint32_t number);
    Mesh withSceneMaterials(LoadedMesh& loaded, std::uint32_t number, const SectionReader& object,
                            const MeshUse& use);
    void readAttributes(const SectionReader& section, Mesh& mesh) const;
    void addMaps(LoadedMesh& loaded, const std::string& path);
    void checkMaterials(const SectionReader& object, const LoadedMesh& loaded, const Mesh& mesh,
                        const MeshUse& use) const;
    std::optional<std::uint32_t> readWritten(const SectionReader& mesh, const NormalsUse& normals);
    std::optional<std::uint32_t> readGltf(const SectionReader& object);
    Mesh gltfMesh(const SectionReader& form, const std::string& path, const GltfPrimitive& which);

    Diagnostics& out_;
    SceneFiles& files_;
    TextureReader& textures_;
    GltfFiles& gltf_;
    MaterialReader& materials_;
    SceneRoom& room_;
    Scene& scene_;
    /// By node: what an alias repeats is read once.
    std::map<std::pair<const YamlNode*, NormalsUse>, std::optional<std::uint32_t>> written_;
    std::unique_ptr<LoadedMesh> offered_;
    std::map<FileUse, std::unique_ptr<LoadedMesh>> loaded_;  ///< Null for a file that failed.
    std::map<std::pair<FileUse, std::vector<PartUse>>, std::uint32_t> meshes_;
    std::map<std::tuple<std::string, GltfPrimitive, NormalsUse>, std::optional<std::uint32_t>> gltf_meshes_;
    struct WithoutArea {
        std::uint64_t triangles = 0, primitives = 0;
    };
    std::map<std::string, WithoutArea> without_area_;  ///< By glTF file.
    /// The mesh of the scene that a file became, and its materials there.
    struct TakenMesh {
        std::uint32_t mesh;
        std::vector<std::int32_t> material;
    };
    std::map<const LoadedMesh*, TakenMesh> taken_;
};

}  // namespace crt
