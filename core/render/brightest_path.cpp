#include "render/brightest_path.h"

#include "base/parallel.h"
#include "kernel/geometry/boxes.h"
#include "kernel/geometry/slots.h"
#include "kernel/materials/composition.h"
#include "kernel/transport/direct_light.h"

#include "compile/accelerator.h"
#include "compile/context_of.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace crt {
namespace {

using namespace kernel;

constexpr std::size_t kSurfacePoints = 2048;  ///< Number of surface points, divided evenly among materials.
constexpr std::size_t kMostOfMaterial = 64;  ///< Points of one material at most.
constexpr std::uint32_t kLightsPerPoint = 4;
constexpr std::uint32_t kSamplesOfBsdf = 8;
/// Intersection tests of shadow rays with surfaces. They would take about a tenth of a second.
constexpr std::uint64_t kTests = 10'000'000;
constexpr std::uint64_t kLeastRays = 4;
constexpr std::uint32_t kSlotsOfBox = 64;  ///< Neighbours in a file are mostly neighbours in space.

/// Paths are rare if they are this many times as bright as 99 % of the paths that arrive from random
/// directions.
constexpr double kRare = 10;
constexpr std::size_t kHundredth = 100;

/// A path that scatters once and then reaches a light.
struct LitPath {
    double luminance;  ///< Of the path if the light is unoccluded.
    CrtRay to_light;
};

/// Points on the surfaces of a scene, and the light that they scatter.
class SurfacePoints {
public:
    explicit SurfacePoints(const CompiledScene& scene) : context_(contextOf(scene)) {
        triangles_ = CRT_ARRAY(CrtTriangle, context_.blob, context_.scene->triangles);
        boxes_.resize(partsOf(context_.scene->triangle_count, kSlotsOfBox));
        parallelFor(
            context_.scene->triangle_count, kSlotsOfBox * 64, [&](std::size_t first, std::size_t end) {
                for (std::size_t slot = first; slot < end; slot += kSlotsOfBox)
                    boxes_[slot / kSlotsOfBox] = boundsOfSlots(slot, std::min(end, slot + kSlotsOfBox));
            });
    }

    /// Points on surfaces that do not emit, ordered by material and then as in the scene file.
    std::vector<CrtHit> choose() const;

    /// A path that arrives at `hit` from the mirror direction of a light, and a path that arrives from a
    /// random direction.
    std::pair<std::optional<LitPath>, std::optional<LitPath>> light(const CrtHit& hit,
                                                                    std::uint32_t number) const;

    /// Luminance of the brightest unoccluded path, after the `left_out` brightest are skipped. Nothing if
    /// all paths that were tested are occluded.
    std::optional<double> brightest(std::vector<LitPath> paths, std::size_t left_out = 0) const;

private:
    TriangleBounds boundsOfSlots(std::size_t first, std::size_t end) const;
    CrtHit hitOf(std::uint32_t slot, std::uint32_t instance, std::uint32_t number) const;
    CrtVertex vertexOf(const CrtSurface& surface, std::uint32_t slot, vec3 wo, vec4 position) const;
    bool mirrors(const CrtVertex& vertex, CrtSampler& sampler) const;
    vec4 mirrored(const CrtVertex& vertex, const CrtDirectSample& offer, CrtSampler& sampler) const;
    std::optional<LitPath> carry(const CrtVertex& vertex, const CrtDirectSample& offer, vec4 share,
                                 const CrtWavelengths& wavelengths) const;
    bool occludes(const CrtRay& ray) const;
    bool occludes(const CrtRay& ray, std::uint32_t first, std::uint32_t end) const;

    CrtContext context_{};
    const CrtTriangle* triangles_ = nullptr;
    std::vector<TriangleBounds> boxes_;  ///< Of kSlotsOfBox slots each.
};

TriangleBounds SurfacePoints::boundsOfSlots(std::size_t first, std::size_t end) const {
    TriangleBounds all = boundsOf(triangles_[first], CRT_BOX_PADDING);
    for (std::size_t slot = first + 1; slot < end; ++slot) {
        const TriangleBounds own = boundsOf(triangles_[slot], CRT_BOX_PADDING);
        for (std::size_t k = 0; k < 3; ++k) {
            all.lower[k] = std::min(all.lower[k], own.lower[k]);
            all.upper[k] = std::max(all.upper[k], own.upper[k]);
        }
    }
    return all;
}

/// A point on the triangle or shape of the slot, chosen by the random numbers of `number`.
CrtHit SurfacePoints::hitOf(std::uint32_t slot, std::uint32_t instance, std::uint32_t number) const {
    CrtHit hit = crt_no_hit(0);
    hit.slot = slot;
    hit.id = triangles_[slot].id;
    hit.instance = instance;
    const CrtSeed seed = crt_seed(0, 1);
    CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, seed, number, 0);
    const CrtRandom2 u = crt_sample_2d(&sampler, 0);
    if (triangles_[slot].shape == 0) {
        const float root = std::sqrt(u.x);
        hit.b1 = root * (1 - u.y);
        hit.b2 = root * u.y;
        return hit;
    }
    const CrtShape& shape = *crt_shape_of(&context_, triangles_[slot].shape - 1);
    const float z = shape.from_z + u.y * (shape.to_z - shape.from_z);
    const float turn = 4 * u.x - 2;
    const vec3 around = crt_direction_of_turn(turn);
    if (shape.kind == CRT_SHAPE_DISK) {
        hit.b1 = around.x * shape.radius * std::sqrt(u.y);
        hit.b2 = around.y * shape.radius * std::sqrt(u.y);
    } else if (shape.kind == CRT_SHAPE_CYLINDER) {
        hit.b1 = turn;
        hit.b2 = z;
    } else {
        const float height = z / shape.radius, across = std::sqrt(std::max(0.0f, 1 - height * height));
        const vec3 direction = crt_load3(shape.x) * (around.x * across) +
                               crt_load3(shape.y) * (around.y * across) + crt_load3(shape.z) * height;
        crt_direction_to_square(direction, &hit.b1, &hit.b2);
    }
    return hit;
}

std::vector<CrtHit> SurfacePoints::choose() const {
    const CrtScene& scene = *context_.scene;
    const auto* primitives = CRT_ARRAY(CrtPrimitive, context_.blob, scene.primitives);
    const auto* instances = CRT_ARRAY(CrtInstance, context_.blob, scene.instances);
    // Primitives in the author's order, with their slots.
    std::vector<std::uint32_t> slots(scene.primitives.count, CRT_NONE);
    for (std::uint32_t slot = 0; slot < scene.triangles.count; ++slot)
        if (triangles_[slot].shape < CRT_SLOT_INSTANCE && triangles_[slot].id < slots.size())
            slots[triangles_[slot].id] = slot;
    std::vector<std::vector<std::uint32_t>> of_materials(scene.materials.count);
    for (std::uint32_t id = 0; id < slots.size(); ++id)
        if (slots[id] != CRT_NONE && primitives[id].light == CRT_NONE)
            of_materials[primitives[id].material].push_back(id);
    const auto used = static_cast<std::size_t>(std::count_if(
        of_materials.begin(), of_materials.end(), [](const auto& ids) { return !ids.empty(); }));
    const std::size_t each = std::clamp<std::size_t>(kSurfacePoints / std::max<std::size_t>(used, 1), 1,
                                                     kMostOfMaterial);
    std::map<std::uint32_t, std::vector<std::uint32_t>> instances_of;  // Meshes, by their first primitives.
    for (std::uint32_t i = 0; i < scene.instances.count; ++i)
        instances_of[instances[i].first_primitive].push_back(i);
    std::vector<CrtHit> hits;
    for (const std::vector<std::uint32_t>& ids : of_materials)
        for (std::size_t k = 0; k < each && !ids.empty(); ++k) {
            const std::uint32_t id = ids[k * ids.size() / each], slot = slots[id];
            const auto number = static_cast<std::uint32_t>(hits.size());
            std::uint32_t instance = 0;
            if (slot >= scene.triangle_count) {
                const auto& there = std::prev(instances_of.upper_bound(id))->second;
                instance = there[crt_hash(number) % there.size()] + 1;
            }
            hits.push_back(hitOf(slot, instance, number));
        }
    return hits;
}

CrtVertex SurfacePoints::vertexOf(const CrtSurface& surface, std::uint32_t slot, vec3 wo,
                                  vec4 position) const {
    CrtVertex vertex;
    vertex.surface = surface;
    vertex.wo = wo;
    crt_vertex_prepare(&context_, &vertex, slot, position, splat4(1), 0, 0);
    return vertex;
}

/// True if the vertex scatters part of the light into a single direction.
bool SurfacePoints::mirrors(const CrtVertex& vertex, CrtSampler& sampler) const {
    const vec4 kFirstIsHero = make_vec4(1, 0, 0, 0);
    for (std::uint32_t k = 0; k < kSamplesOfBsdf; ++k) {
        const std::uint32_t dimension = crt_vertex_dimension(k + 1);
        const CrtScatter scatter =
            crt_vertex_sample(&vertex, crt_sample_2d(&sampler, dimension + CRT_DIM_BSDF),
                              crt_sample_2d(&sampler, dimension + CRT_DIM_CHOICE), kFirstIsHero, 0,
                              CRT_RADIANCE);
        if (scatter.valid && scatter.pdf == 0) return true;
    }
    return false;
}

/// The factor on the light's spectrum that crt_sample_lights computes.
vec4 scattered(const CrtVertex& vertex, const CrtDirectSample& offer) {
    if (crt_vertex_is_delta(&vertex)) return splat4(0);
    return crt_vertex_eval(&vertex, offer.wi, CRT_RADIANCE) * offer.irradiance;
}

/// The same for a path that arrives from the mirror direction of the light. If scattered rays can also reach
/// the light, the path carries at most its radiance. The cosine compensates for grazing angles, where paths
/// are brighter and proportionally rarer.
vec4 SurfacePoints::mirrored(const CrtVertex& vertex, const CrtDirectSample& offer,
                             CrtSampler& sampler) const {
    vec4 share = scattered(vertex, offer);
    if (offer.pdf > 0) {
        const vec4 whole = splat4(offer.irradiance * offer.pdf);
        const bool by_chance_alone = context_.scene->nee == CRT_NEE_NONE && max4(share) > 0;
        share = by_chance_alone || mirrors(vertex, sampler) ? whole : crt_min4(share, whole);
    }
    return share * crt_abs(dot3(vertex.bsdf.wo, vertex.bsdf.ns));
}

std::optional<LitPath> SurfacePoints::carry(const CrtVertex& vertex, const CrtDirectSample& offer,
                                            vec4 share, const CrtWavelengths& wavelengths) const {
    const auto* lights = CRT_ARRAY(CrtLight, context_.blob, context_.scene->lights);
    const vec4 position = wavelengths.position,
               light = offer.environment
                           ? crt_environment_radiance(&context_, offer.place, position)
                           : crt_value(&context_, lights[offer.light].radiance, nullptr, position);
    const auto luminance = static_cast<double>(V4Y(crt_to_xyz(&context_, wavelengths, share * light)));
    if (!(luminance > 0) || !std::isfinite(luminance)) return std::nullopt;
    CrtRay ray;
    const bool far = offer.distance == CRT_INFINITY;
    const CrtSurface& surface = vertex.surface;
    ray.o = crt_offset_origin(surface.p, surface.clearance, crt_vertex_side(&vertex), offer.wi);
    ray.d = far ? offer.wi : offer.point - ray.o;
    ray.reach = far ? CRT_INFINITY : offer.reach;
    return LitPath{luminance, ray};
}

std::pair<std::optional<LitPath>, std::optional<LitPath>> SurfacePoints::light(const CrtHit& hit,
                                                                        std::uint32_t number) const {
    CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, crt_seed(0, 2), number, 0);
    const CrtWavelengths wavelengths =
        crt_sample_wavelengths(&context_, crt_sample_1d(&sampler, CRT_DIM_WAVELENGTH));
    CrtSurface surface = crt_surface(&context_, hit);
    surface.medium = 0;
    surface.touches = 0;
    surface.material = crt_chosen_material(&context_, &surface, -surface.ns, &sampler,
                                           crt_vertex_dimension(0) + CRT_DIM_MIX);
    const CrtRandom2 u = crt_sample_2d(&sampler, crt_vertex_dimension(0) + CRT_DIM_BSDF);
    CrtVertex vertex =
        vertexOf(surface, hit.slot, crt_cosine_direction(surface.ns, u), wavelengths.position);
    const CrtDirectSample offer = crt_direct_sample(&context_, &sampler, crt_vertex_dimension(0), &vertex);
    if (!(offer.irradiance > 0)) return {};
    const std::optional<LitPath> from_anywhere =
        carry(vertex, offer, scattered(vertex, offer), wavelengths);
    const vec3 ns = vertex.bsdf.ns, side = dot3(offer.wi, ns) < 0 ? -ns : ns;
    vertex = vertexOf(surface, hit.slot, crt_reflect(offer.wi, side), wavelengths.position);
    return {carry(vertex, offer, mirrored(vertex, offer, sampler), wavelengths), from_anywhere};
}

bool SurfacePoints::occludes(const CrtRay& ray) const {
    if (!(ray.reach > 0)) return false;
    const CrtSlab slab = crt_slab(ray);
    const auto count = context_.scene->triangle_count;
    for (std::uint32_t box = 0; box < boxes_.size(); ++box)
        if (crt_box(boxes_[box].lower.data(), boxes_[box].upper.data(), ray, slab, ray.reach) <
                CRT_INFINITY &&
            occludes(ray, box * kSlotsOfBox, std::min(count, (box + 1) * kSlotsOfBox)))
            return true;
    return false;
}

bool SurfacePoints::occludes(const CrtRay& ray, std::uint32_t first, std::uint32_t end) const {
    const CrtShear shear = crt_shear(ray);
    for (std::uint32_t slot = first; slot < end; ++slot) {
        if (triangles_[slot].shape >= CRT_SLOT_INSTANCE) continue;
        CrtHit hit = crt_no_hit(ray.reach);
        crt_test_slot(&context_, triangles_, slot, ray, shear, &hit);
        if (hit.slot != CRT_NONE && !crt_may_pass(&context_, hit)) return true;
    }
    return false;
}

/// Tests the brightest paths first. The more of them are occluded, the more of the next are skipped.
std::optional<double> SurfacePoints::brightest(std::vector<LitPath> paths, std::size_t left_out) const {
    std::stable_sort(paths.begin(), paths.end(),
                     [](const LitPath& a, const LitPath& b) { return a.luminance > b.luminance; });
    const std::uint64_t rays =
        std::max(kTests / std::max<std::uint64_t>(context_.scene->triangle_count, 1), kLeastRays);
    std::size_t next = left_out;
    for (std::uint64_t asked = 0; next < paths.size(); ++asked) {
        if (asked == rays || !occludes(paths[next].to_light)) return paths[next].luminance;
        next += 1 + asked / 8;
    }
    return std::nullopt;
}

}  // namespace

BrightestPath brightestPathOf(const CompiledScene& scene) {
    const CrtScene& header = scene.header();
    if (header.integrator != CRT_INTEGRATOR_PATH || header.lights.count == 0) return {};
    const SurfacePoints points(scene);
    const std::vector<CrtHit> hits = points.choose();
    using OfPoint = std::array<std::pair<std::optional<LitPath>, std::optional<LitPath>>, kLightsPerPoint>;
    std::vector<OfPoint> lit(hits.size());
    parallelFor(hits.size(), 16, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            for (std::uint32_t k = 0; k < kLightsPerPoint; ++k)
                lit[i][k] = points.light(hits[i], static_cast<std::uint32_t>(i) * kLightsPerPoint + k);
    });
    std::vector<LitPath> mirrored, from_anywhere;
    for (const OfPoint& of_point : lit)
        for (const auto& [of_mirror, of_anywhere] : of_point) {
            if (of_mirror) mirrored.push_back(*of_mirror);
            if (of_anywhere) from_anywhere.push_back(*of_anywhere);
        }
    const std::optional<double> brightest = points.brightest(std::move(mirrored));
    if (!brightest) return {};
    const std::size_t hundredth = hits.size() * kLightsPerPoint / kHundredth;
    const double ordinary = points.brightest(std::move(from_anywhere), hundredth).value_or(0);
    return {*brightest, *brightest > kRare * ordinary};
}

}  // namespace crt
