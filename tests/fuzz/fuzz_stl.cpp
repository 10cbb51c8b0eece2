// STL → Mesh, and normals for it.
#include "check_mesh.h"
#include "fuzz_target.h"

#include "scene/mesh/stl_reader.h"
#include "scene/mesh/vertex_normals.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        LoadedMesh loaded = readStl({reinterpret_cast<const char*>(data), size}, "a.stl");
        fuzz::checkMesh(loaded);
        makeSmoothNormals(loaded.mesh, 60);
        fuzz::checkMesh(loaded);
    });
    return 0;
}
