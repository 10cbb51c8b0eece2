// Scene YAML → Scene → CompiledScene, with a BVH and without, and what its films say of it. The text is
// a whole scene file; beside it lie a mesh and a spectrum that it may name.
#include "fuzz_target.h"

#include "compile/compile.h"
#include "film/film_record.h"
#include "render/light_checks.h"
#include "scene/yaml/scene_yaml.h"

#include <limits>

namespace {

/// The assumed folder of the scene file.
struct Neighbours : crt::fuzz::Directory {
    Neighbours() {
        write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
        write("a.mtl", "newmtl m\nKd .5 .5 .5\nKe 1 1 1\n");
        write("a.spd", "300 0.2\n900 0.8\n");
    }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    static const Neighbours neighbours;
    const std::string text(reinterpret_cast<const char*>(data), size);
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        const Scene scene = parseScene(text, "scene.yaml", neighbours.path());
        const CompiledScene compiled = compileScene(scene, kAovsOfFirstHits);
        if (compiled.hash.size() != 32 ||
            compiled.size_bytes > compiled.blob.size() * sizeof(CompiledScene::Line))
            fuzz::finding("compiled scene", "is not what its sizes say");
        // As for a backend that brings its own acceleration structure.
        if (compileScene(scene, kAovsOfFirstHits,
                         {.accelerator_reach = std::numeric_limits<double>::infinity()})
                .hash != compiled.hash)
            fuzz::finding("compiled scene", "is another one without a BVH");
        (void)idleLamps(scene);
        const FilmRecord record = recordOf(scene);
        if (!differingTraits(readRecord(recordText(record)), record).empty())
            fuzz::finding("record", "is not read as it was written");
    });
    return 0;
}
