// PLY → Mesh, in blocks of two sizes, which must not differ; and normals for it.
#include "check_mesh.h"
#include "fuzz_target.h"

#include "base/stage.h"
#include "scene/mesh/ply_header.h"
#include "scene/mesh/ply_reader.h"
#include "scene/mesh/vertex_normals.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const fuzz::Directory directory;
    const std::string content(reinterpret_cast<const char*>(data), size);
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        LoadedMesh loaded = loadPly(directory.write("a.ply", content));
        fuzz::checkMesh(loaded);
        Stage stage("reading");
        const LoadedMesh other = readPly(content, "a.ply", {PlyColor::Linear}, stage, 3);
        if (other.mesh.positions != loaded.mesh.positions || other.mesh.triangles != loaded.mesh.triangles ||
            other.mesh.normals != loaded.mesh.normals ||
            other.mesh.normal_index != loaded.mesh.normal_index || other.mesh.uvs != loaded.mesh.uvs ||
            other.mesh.uv_index != loaded.mesh.uv_index)
            fuzz::finding("mesh", "is another one in smaller blocks");
        makeSmoothNormals(loaded.mesh, 60);
        fuzz::checkMesh(loaded);
    });
    return 0;
}
