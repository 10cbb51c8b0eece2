// OBJ and MTL → Mesh. The input is an OBJ file; what follows a line "%%mtl" is the material file "a.mtl".
// Beside them lies a spectrum that it may name.
#include "check_mesh.h"
#include "fuzz_target.h"

#include "scene/mesh/mesh_io.h"
#include "scene/mesh/vertex_normals.h"

#include <algorithm>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    static const std::string spectrum = directory.write("a.spd", "300 0.2\n900 0.8\n");
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    constexpr std::string_view kMark = "%%mtl\n";
    const std::size_t split = std::min(text.find(kMark), text.size());
    const std::string obj = directory.write("a.obj", text.substr(0, split));
    directory.write("a.mtl", text.substr(std::min(split + kMark.size(), text.size())));
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        LoadedMesh loaded = loadObj(obj);
        fuzz::checkMesh(loaded);
        makeSmoothNormals(loaded.mesh, 60);
        fuzz::checkMesh(loaded);
    });
    return 0;
}
