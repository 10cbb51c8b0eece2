// glTF and GLB → text of a scene → Scene. An input that begins with "glTF" is a GLB, everything else
// JSON with its bytes in data: URIs.
#include "fuzz_target.h"

#include "scene/import/import.h"
#include "scene/yaml/scene_yaml.h"

#include <cmath>

namespace {

/// The guarantees of readGltfPrimitive().
void checkMesh(const crt::Mesh& mesh) {
    using crt::fuzz::finding;
    if (mesh.triangles.empty()) finding("mesh", "has no triangles");
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t index : triangle)
            if (index >= mesh.positions.size()) finding("mesh", "an index is out of range");
    for (const crt::Vec3d& position : mesh.positions)
        for (const double x : position)
            if (!std::isfinite(x)) finding("mesh", "a coordinate is not finite");
    if (!mesh.uvs.empty() && mesh.uvs.size() != mesh.positions.size())
        finding("mesh", "has not one pair of texture coordinates a vertex");
    if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size())
        finding("mesh", "has not one colour a vertex");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    const std::string_view content(reinterpret_cast<const char*>(data), size);
    const std::string path = directory.write(content.starts_with("glTF") ? "a.glb" : "a.gltf", content);
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        GltfFiles files;
        const std::string text = importModel(files, path).scene;
        try {
            // An object whose mesh has no face of an area is left out; its mesh stays, and nothing uses it.
            const Scene scene = parseScene(text, "scene.yaml", directory.path());
            for (const Object& object : scene.objects)
                if (!object.shape) checkMesh(scene.meshes.at(object.mesh));
        } catch (const Error& error) {
            // The text may name what cannot be read, but must be a scene.
            for (const char* word : {"unknown key", "expected ", "is missing in", "exclude each other",
                                     "there is no material", "it must be"})
                if (std::string_view(error.what()).find(word) != std::string_view::npos)
                    fuzz::finding("the import writes what is no scene", error.what());
            throw;
        }
    });
    return 0;
}
