// OBJ and MTL → Mesh. The input is an OBJ file; what follows a line "%%mtl" is the material file "a.mtl".
// Beside them lies a spectrum that it may name.
#include "fuzz_target.h"

#include "scene/mesh/mesh_io.h"

#include <algorithm>
#include <cmath>

namespace {

/// What loadObj() promises to everybody behind it.
void checkMesh(const crt::LoadedMesh& loaded) {
    using crt::fuzz::finding;
    const crt::Mesh& mesh = loaded.mesh;
    if (mesh.triangles.empty()) finding("mesh", "has no triangles");
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t index : triangle)
            if (index >= mesh.positions.size()) finding("mesh", "an index is out of range");
    for (const auto& triangle : mesh.normal_index)
        for (const std::uint32_t index : triangle)
            if (index != crt::kNoNormal && index >= mesh.normals.size())
                finding("mesh", "a normal's index is out of range");
    for (const auto& position : mesh.positions)
        for (const double x : position)
            if (!std::isfinite(x)) finding("mesh", "a coordinate is not finite");
    for (const auto& triangle : mesh.normal_index)
        for (const std::uint32_t index : triangle)
            if (index != crt::kNoNormal)
                for (const double x : mesh.normals[index])
                    if (!std::isfinite(x)) finding("mesh", "a normal in use is not finite");
    for (const std::int32_t m : mesh.material)
        if (m < -1 || m >= static_cast<std::int32_t>(loaded.materials.size()))
            finding("mesh", "a material's index is out of range");
    if (!mesh.material.empty() && mesh.material.size() != mesh.triangles.size())
        finding("mesh", "has not one material a triangle");
    for (const crt::LoadedMaterial& m : loaded.materials)
        if (m.mtl && m.mtl->material.type == crt::MaterialType::Dielectric &&
            !(m.mtl->material.eta.min() > 1.0))
            finding("glass", "does not refract");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    static const std::string spectrum = directory.write("a.spd", "300 0.2\n900 0.8\n");
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    constexpr std::string_view kMark = "%%mtl\n";
    const std::size_t split = std::min(text.find(kMark), text.size());
    const std::string obj = directory.write("a.obj", text.substr(0, split));
    directory.write("a.mtl", text.substr(std::min(split + kMark.size(), text.size())));
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] { checkMesh(loadObj(obj)); });
    return 0;
}
