#include "compile/accelerator.h"

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "kernel/geometry/intersect.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crt {
namespace {

constexpr std::size_t kPart = std::size_t{1} << 16;  // of what a thread takes at a time

std::uint32_t acceleratorOf(const Scene& scene, const FlatScene& flat) {
    const std::size_t triangles = flat.triangles.size();
    // Nothing to find; and the view of the boxes looks for no triangle.
    if (triangles == 0 || !tracesSurfaces(scene.integrator.type)) return CRT_ACCELERATOR_BRUTE_FORCE;
    switch (scene.integrator.accelerator) {
        case Accelerator::Bvh: return CRT_ACCELERATOR_BVH;
        case Accelerator::Aabb: return CRT_ACCELERATOR_AABB;
        case Accelerator::None: return CRT_ACCELERATOR_BRUTE_FORCE;
        case Accelerator::Auto: break;
    }
    return triangles <= kBruteForceTriangles && flat.instances.empty() ? CRT_ACCELERATOR_BRUTE_FORCE
                                                                       : CRT_ACCELERATOR_BVH;
}

}  // namespace

bool backendFindsHits(const Camera& camera, const Vec3d& centre, int scale_exponent,
                      const CompileOptions& options) {
    const double scale = std::ldexp(1.0, scale_exponent);
    double farthest = 1;
    for (std::size_t k = 0; k < 3; ++k)
        farthest = std::max(farthest, std::abs(camera.position[k] - centre[k]) * scale +
                                          camera.aperture_radius * scale);
    // A little less, for what is rounded on the way to the ray.
    return farthest < options.accelerator_reach * (1 - 1e-6);
}

TriangleBounds boundsOf(const FlatScene& flat, std::size_t id) {
    TriangleBounds b{};
    for (std::size_t k = 0; k < 3; ++k) {
        const float* p = &flat.positions[id][3 * k];
        b.lower[k] = std::min({p[0], p[1], p[2]});
        b.upper[k] = std::max({p[0], p[1], p[2]});
    }
    return b;
}

TriangleBounds boundsOf(const kernel::CrtTriangle& triangle, float padding) {
    TriangleBounds b{};
    for (std::size_t k = 0; k < 3; ++k) {
        const float* p = triangle.p + 3 * k;
        b.lower[k] = std::min({p[0], p[1], p[2]}) - padding;
        b.upper[k] = std::max({p[0], p[1], p[2]}) + padding;
    }
    return b;
}

MeshTrees compileMeshTrees(const FlatScene& flat) {
    std::vector<Bvh> built(flat.meshes.size());
    parallelFor(built.size(), 1, [&](std::size_t mesh, std::size_t) {
        const FlatScene& own = flat.meshes[mesh].flat;
        std::vector<TriangleBounds> bounds(own.triangles.size());
        for (std::size_t i = 0; i < bounds.size(); ++i) bounds[i] = boundsOf(own, i);
        built[mesh] = buildBvh(bounds, 0, "building the BVH of a mesh");
    });
    MeshTrees trees;
    std::uint32_t slot = static_cast<std::uint32_t>(flat.triangles.size());
    for (Bvh& bvh : built) {
        const auto first_node = static_cast<std::uint32_t>(trees.nodes.size());
        for (kernel::CrtNode4& node : bvh.nodes)
            for (std::uint32_t& child : node.child) child += ((child & 15u) != 0 ? slot : first_node) << 4;
        trees.roots.push_back(first_node);
        trees.nodes.insert(trees.nodes.end(), bvh.nodes.begin(), bvh.nodes.end());
        bvh.nodes = {};
        slot += static_cast<std::uint32_t>(bvh.order.size());
        trees.orders.push_back(std::move(bvh.order));
    }
    return trees;
}

AcceleratorPart compileAccelerator(const Scene& scene, const FlatScene& flat,
                                   const CompileOptions& options) {
    const std::size_t count = flat.triangles.size();
    AcceleratorPart part;
    part.kind = acceleratorOf(scene, flat);
    part.without_nodes = part.kind == CRT_ACCELERATOR_BVH &&
                         backendFindsHits(scene.camera, flat.centre, flat.scale_exponent, options);
    if (part.kind == CRT_ACCELERATOR_BVH && !part.without_nodes) {
        const Stopwatch building;
        std::vector<TriangleBounds> bounds(count);
        parallelFor(count, kPart, [&](std::size_t first, std::size_t end) {
            for (std::size_t i = first; i < end; ++i) bounds[i] = boundsOf(flat, i);
        });
        Bvh bvh = buildBvh(bounds, CRT_BOX_PADDING);
        part.nodes = std::move(bvh.nodes);
        part.id_of_slot = std::move(bvh.order);
        part.build_seconds = building.seconds();
    } else {
        part.id_of_slot.resize(count);
        std::iota(part.id_of_slot.begin(), part.id_of_slot.end(), 0u);
    }
    part.slot_of_id.resize(count);
    parallelFor(count, kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t slot = first; slot < end; ++slot)
            part.slot_of_id[part.id_of_slot[slot]] = static_cast<std::uint32_t>(slot);
    });
    return part;
}

}  // namespace crt
