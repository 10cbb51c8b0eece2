/// Scene → CompiledScene: one flat, pointer-free blob (kernel/layout.h) and the feature mask that says
/// what it needs.
#pragma once

#include "kernel/layout.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace crt {

struct CompiledScene {
    struct alignas(64) Line {
        unsigned char bytes[64];
    };
    std::vector<Line> blob;           ///< Read it through data(): 64-byte aligned.
    std::size_t size_bytes = 0;
    std::uint32_t spectral_channels = 0;  ///< Of the film's channels, behind all others.
    std::uint64_t triangles = 0, shapes = 0, instances = 0, emitters = 0, objects = 0, nodes = 0;
    std::uint64_t instanced_triangles = 0;  ///< Of the meshes that instances show, each counted once.
    std::uint64_t images = 0, texel_bytes = 0;  ///< Of textures.
    double camera_reach = 0;          ///< How far from `centre` a camera may be that it serves, too.
    int scale_exponent = 0;           ///< World lengths were multiplied by 2^scale_exponent after centring.
    Vec3d centre{};                   ///< In the author's units.
    bool without_nodes = false;  ///< Scenes of CRT_ACCELERATOR_BVH: left to a backend that brings its own
                                 ///< acceleration structure.
    std::string hash;  ///< 32 hex digits: what a film of this scene belongs to (scene_identity.h).
    double build_seconds = 0;         ///< BVH; 0 where none was built.
    double compile_seconds = 0;
    std::vector<std::pair<std::string, std::string>> left_out;  ///< What this scene does not need, and why.

    unsigned char* data() { return reinterpret_cast<unsigned char*>(blob.data()); }
    const unsigned char* data() const { return reinterpret_cast<const unsigned char*>(blob.data()); }
    kernel::CrtScene& header() { return *reinterpret_cast<kernel::CrtScene*>(data()); }
    const kernel::CrtScene& header() const { return *reinterpret_cast<const kernel::CrtScene*>(data()); }
};

/// What the backend that will read the blob brings itself (crt_backend.h): nothing is built that it would
/// not read.
struct CompileOptions {
    double accelerator_reach = 0;  ///< Of the backend's own acceleration structure; 0: it needs the BVH.
};

/// `aovs` are the bits of Aov that outputs ask for. Warns about a scene without light. Throws
/// crt::Error(Scene) for scenes that cannot be flattened (coordinates too large, more than 2^28 triangles).
CompiledScene compileScene(const Scene& scene, std::uint32_t aovs, const CompileOptions& options = {});

/// "bvh, diffuse, nee": the names of a mask.
std::string featureNames(std::uint64_t mask);

}  // namespace crt
