/// The part of MeshReader that reads objects with `gltf`.
#include "scene/yaml/scene_meshes.h"

#include "base/log.h"

#include <fmt/format.h>

#include <vector>

namespace crt {

Mesh MeshReader::gltfMesh(const SectionReader& form, const std::string& path, const GltfPrimitive& which) {
    GltfFile& file = gltf_.open(path);
    if (bool allow = false; form.read("allow_outside", allow) && allow) file.allowOutside();
    std::uint64_t without_area = 0;
    Mesh mesh = readGltfPrimitive(file, which, without_area);
    for (const std::string& read : file.filesRead()) files_.note(read);
    if (without_area > 0) {
        WithoutArea& lost = without_area_[path];
        lost.triangles += without_area;
        ++lost.primitives;
    }
    return mesh;
}

/// Once a file.
void MeshReader::finish() const {
    for (const auto& [path, lost] : without_area_)
        logWarning("{}: {} triangles of {} primitives have no area and were left out", path, lost.triangles,
                   lost.primitives);
}

/// Nothing if it is invalid; reports the error.
std::optional<std::uint32_t> MeshReader::readGltf(const SectionReader& object) {
    const std::optional<SectionReader> form =
        object.section("gltf", fmt::format("the gltf of {}", object.subject()));
    refuseObjKeys(object);
    if (object.has("vertex_colors")) object.error("vertex_colors", "this is about the colours in a PLY");
    const NormalsUse normals = readNormals(object);
    std::string name;
    GltfPrimitive which;
    if (!form->read("file", name)) return std::nullopt;
    std::uint64_t number = 0;
    if (form->read("mesh", number)) which.mesh = number;
    if (form->read("primitive", number)) which.primitive = number;
    if (form->read("uv_set", number)) which.uv_set = number;
    if (std::vector<double> factor; form->read("color_factor", factor))
        which.color_factor = {factor[0], factor[1], factor[2]};
    form->read("vertex_opacity", which.opacity);
    const std::optional<std::string> path = files_.locate(name, form->place("file"), out_);
    if (!path) return std::nullopt;
    const auto [known, fresh] = gltf_meshes_.try_emplace({*path, which, normals});
    if (!fresh) return known->second;
    try {
        Mesh mesh = gltfMesh(*form, *path, which);
        setNormals(mesh, normals, object.subject());
        known->second = static_cast<std::uint32_t>(scene_.meshes.size());
        scene_.meshes.push_back(std::move(mesh));
    } catch (const Error& e) {
        if (e.kind() == ErrorKind::Internal) throw;
        form->error("file", e.what());
    }
    return known->second;
}

}  // namespace crt
