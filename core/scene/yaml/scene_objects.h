/// Materials and objects of a scene: meshes read and checked, names looked up, placements multiplied out.
#pragma once

#include "scene/gltf/gltf_mesh.h"
#include "scene/mesh/mesh_io.h"
#include "scene/mesh/mesh_parts.h"
#include "scene/mesh/ply_reader.h"
#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_spectra.h"
#include "scene/yaml/scene_textures.h"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt {

class ObjectReader {
public:
    ObjectReader(Diagnostics& out, SceneFiles& files, SpectrumReader& spectra, TextureReader& textures,
                 GltfFiles& gltf, Scene& scene);

    ~ObjectReader();

    /// A file that was read already, with default options: whichever object names it takes it.
    void offer(std::unique_ptr<LoadedMesh> mesh) { offered_ = std::move(mesh); }
    void readMaterials(const YamlNode& map);
    void readObjects(const YamlNode& list);
    /// Warns about materials that no object uses.
    void finish() const;

private:
    /// Source of the normals of an object's mesh.
    struct NormalsUse {
        enum class Source { File, Smooth, Flat } source = Source::File;
        double crease_angle_deg = 60;
        auto operator<=>(const NormalsUse&) const = default;
    };

    /// A file of a mesh, and how it is read.
    struct FileUse {
        std::string path;
        bool ply = false;
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

    void readMaterial(const YamlEntry& entry);
    void readParts(const SectionReader& material);
    void resolveParts();
    void checkParts(const std::vector<std::int32_t>& way);
    std::vector<const Material*> glassOf(const Material& material) const;
    void checkInsides(std::int32_t whole, const YamlPlace& place) const;
    void readThinFilm(const SectionReader& section, Material& material);
    /// A diffuse material that is rough is a plastic without a coat.
    static void makeRoughDiffuse(Material& material);
    void readAnisotropy(const SectionReader& section, Material& material) const;
    struct OpenPbr;
    /// Makes the material of what OpenPBR's keys say, and of further ones, which come before it.
    void readOpenPbr(const SectionReader& section, Material& material);
    bool transmits(const Material& part) const;
    void readObject(const YamlNode& node, const YamlPlace& place, std::size_t number);
    /// Warns of an object whose mesh shows nothing.
    void tellLeftOut(const Object& object, const std::string& subject) const;
    MeshUse readMeshUse(const SectionReader& object, const std::string& material);
    void refuseObjKeys(const SectionReader& object) const;
    void refuseMeshKeys(const SectionReader& object) const;
    NormalsUse readNormals(const SectionReader& object) const;
    static void setNormals(Mesh& mesh, const NormalsUse& use, const std::string& subject);
    std::vector<PartUse> readMeshParts(const SectionReader& object);
    void tellUnknownParts(const SectionReader& object, const PartFinder& parts) const;
    std::optional<std::int32_t> readEmission(const SectionReader& section, std::int32_t material,
                                             const std::string& material_name);
    LoadedMesh* load(const SectionReader& object, const FileUse& use);
    std::unique_ptr<LoadedMesh> takeOffered(const FileUse& use);
    std::optional<std::uint32_t> readMeshFile(const SectionReader& object, MeshUse use);
    static bool hasShape(const SectionReader& object);
    std::optional<std::uint32_t> readShape(const SectionReader& section, Object& object);
    Mesh takeMesh(LoadedMesh& loaded, std::uint32_t number);
    Mesh withSceneMaterials(LoadedMesh& loaded, std::uint32_t number, const SectionReader& object,
                            const MeshUse& use);
    void readAttributes(const SectionReader& section, Mesh& mesh) const;
    void addMaps(LoadedMesh& loaded, const std::string& path);
    void checkTextures(const SectionReader& section, const Object& object) const;
    void checkMaterials(const SectionReader& object, const LoadedMesh& loaded, const Mesh& mesh,
                        const MeshUse& use) const;
    std::optional<std::uint32_t> readMesh(const SectionReader& mesh, const NormalsUse& normals);
    std::optional<std::uint32_t> readGltf(const SectionReader& object);
    void tellGltf() const;
    Mesh gltfMesh(const SectionReader& form, const std::string& path, const GltfPrimitive& which);
    std::optional<std::int32_t> findMaterial(const std::string& name, const YamlPlace& place,
                                             bool from_mtl_possible);
    std::optional<Matrix4d> readPlacement(const YamlNode& list, const YamlPlace& place,
                                          const std::string& subject);
    std::vector<Matrix4d> readPlacements(const SectionReader& object);
    /// Stops when what was read so far is too large to be written out.
    void requireRoom(const YamlPlace& place);

    struct NamedMaterial {
        std::int32_t index = -1;  ///< −1: known, but wrong.
        YamlPlace place;
        bool used = false;
    };

    Diagnostics& out_;
    SceneFiles& files_;
    SpectrumReader& spectra_;
    TextureReader& textures_;
    GltfFiles& gltf_;
    Scene& scene_;
    std::map<std::string, NamedMaterial> materials_;
    std::vector<std::string> material_names_;  ///< In the order of the file.
    /// By the number of a material that is made of others: what they are called, and where.
    struct PartName {
        std::string name;
        YamlPlace place;
    };
    std::map<std::int32_t, std::array<PartName, 2>> parts_;
    /// By node: what an alias repeats is read once.
    std::map<std::pair<const YamlNode*, NormalsUse>, std::optional<std::uint32_t>> written_meshes_;
    std::map<const YamlNode*, std::optional<Matrix4d>> written_placements_;
    ExpansionLimit limit_;
    std::uint64_t placements_ = 0, triangles_ = 0;  ///< Read so far.
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
