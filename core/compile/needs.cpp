#include "compile/needs.h"

#include "compile/accelerator.h"
#include "compile/light_tree.h"
#include "compile/point_lights.h"
#include "kernel/dialect/features.h"
#include "scene/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace crt {
namespace {

// A sum of equal bits carries into another.
#define CRT_FEATURE_SUM(bit, name, text) +(1ull << (bit))
static_assert((0ull CRT_FEATURE_LIST(CRT_FEATURE_SUM)) == CRT_FEATURES_ALL, "two features share a bit");
#undef CRT_FEATURE_SUM

bool isOfLight(const Scene& scene) { return measuresLight(scene.integrator.type); }

/// True if light is ever scattered; if not, materials, light sampling and roulette have nothing to do.
bool scatters(const Scene& scene) { return isOfLight(scene) && scene.integrator.max_depth > 0; }

}  // namespace

std::uint64_t featuresOf(const Scene& scene, const kernel::CrtScene& header, const MaterialPart& materials,
                         const TexturePart& textures, std::uint64_t of_lights) {
    std::uint64_t f = textures.features | of_lights;
    const auto need = [&](bool condition, std::uint64_t feature) { f |= condition ? feature : 0; };
    need(header.sampler == CRT_SAMPLER_SOBOL, CRT_FEATURE_SOBOL);
    need(header.sampler == CRT_SAMPLER_INDEPENDENT, CRT_FEATURE_INDEPENDENT);
    need(header.sampler == CRT_SAMPLER_XORSHIFT, CRT_FEATURE_XORSHIFT);
    const bool traces = tracesSurfaces(scene.integrator.type);
    need(traces && header.accelerator == CRT_ACCELERATOR_BVH, CRT_FEATURE_BVH);
    need(traces && header.accelerator == CRT_ACCELERATOR_BRUTE_FORCE, CRT_FEATURE_BRUTE_FORCE);
    need(traces && header.accelerator == CRT_ACCELERATOR_AABB, CRT_FEATURE_AABB);
    // Even where nothing is scattered, the albedo of first hits is a material's, and panes are passed.
    const bool passes_panes = isOfLight(scene) && (materials.features & CRT_FEATURE_THIN_DIELECTRIC) != 0;
    if (scatters(scene) || (header.aovs & kAovAlbedo) != 0 || passes_panes) f |= materials.features;
    need(isOfLight(scene), materials.features & (CRT_FEATURE_MEDIA | CRT_FEATURE_OPACITY));
    need(traces && header.normals.count > 0, CRT_FEATURE_SMOOTH_NORMALS);
    need(traces && header.shapes.count > 0, CRT_FEATURE_SHAPES);
    need(traces && header.instances.count > 0, CRT_FEATURE_INSTANCES);
    const bool samples_environment = header.environment_light != 0;
    need(header.lights.count > header.point_lights.count + (samples_environment ? 1u : 0u),
         CRT_FEATURE_AREA_LIGHT);
    need(scatters(scene) && header.lights.count > 0 && header.nee &&
             (materials.features & (CRT_FEATURES_LOBE | CRT_FEATURE_FUZZ | CRT_FEATURE_CLEARCOAT)) != 0,
         CRT_FEATURE_NEE);
    need(header.environment != CRT_NONE, CRT_FEATURE_ENVIRONMENT);
    need(header.environment_image.count > 0, CRT_FEATURE_ENVIRONMENT_IMAGE);
    need((f & CRT_FEATURE_NEE) != 0 && samples_environment, CRT_FEATURE_ENVIRONMENT_LIGHT);
    // Of lights without a surface, suns alone are seen without light sampling. They come first.
    const std::vector<const PointLight*> lights = shiningPointLights(scene);
    need(!lights.empty() &&
             ((f & CRT_FEATURE_NEE) != 0 || lights.front()->type == PointLightType::Sun),
         CRT_FEATURE_POINT_LIGHT);
    need((f & CRT_FEATURE_NEE) != 0 && header.tree_lights != 0, CRT_FEATURE_LIGHT_TREE);
    need(header.spectra.count > 0, CRT_FEATURE_TABLE);
    need(header.camera.lens_radius > 0, CRT_FEATURE_LENS);
    need(header.filter.count > 0, CRT_FEATURE_FILTER);
    f |= rowOf(scene.integrator.type).features;
    need((header.aovs & (kAovsOfFirstHits | kAovColorError)) != 0, CRT_FEATURE_AOV);
    need((header.aovs & kAovReplicates) != 0, CRT_FEATURE_REPLICATES);
    need(header.spectral_film.count > 0, CRT_FEATURE_SPECTRAL_FILM);
    return f;
}

LeftOut leftOut(const Scene& scene, const kernel::CrtScene& header, std::size_t occluders,
                bool without_nodes) {
    LeftOut all;
    const auto left_out = [&](const char* what, const std::string& why) { all.emplace_back(what, why); };
    const auto has = [&](std::uint64_t feature) { return (header.features & feature) != 0; };
    if (header.accelerator != CRT_ACCELERATOR_BVH)
        left_out("BVH", scene.integrator.accelerator == Accelerator::Auto
                            ? fmt::format("{} {}: testing all of them is faster (up to {})",
                                          header.triangle_count,
                                          header.shapes.count > 0 ? "triangles and shapes" : "triangles",
                                          kBruteForceTriangles)
                            : std::string("integrator.accelerator selects another structure"));
    if (without_nodes) left_out("BVH", "the backend builds its own acceleration structure");
    const std::size_t triangles = header.triangle_count - header.shapes.count - header.instances.count;
    if (has(CRT_FEATURE_NEE) && has(CRT_FEATURE_BRUTE_FORCE) && occluders < triangles)
        left_out("shadow tests",
                 fmt::format("{} of {} triangles have the whole scene on one side and cannot block light",
                             triangles - occluders, triangles));
#define CRT_LEFT_OUT_MATERIAL(F, bit, NAME, Name, word, scatter, text) \
    if (!has(CRT_FEATURE_##NAME)) left_out(text, "no surface uses it");
    CRT_MATERIAL_LIST(CRT_LEFT_OUT_MATERIAL, )
#undef CRT_LEFT_OUT_MATERIAL
    if (!has(CRT_FEATURE_TABLE)) left_out("tables of spectra", "all values are the same at all wavelengths");
    if (!has(CRT_FEATURE_TEXTURE)) left_out("textures", "no value depends on the place");
#define CRT_LEFT_OUT_PATTERN(number, NAME, Name, word, KERNELS) \
    if (has(CRT_FEATURE_TEXTURE) && !has(CRT_FEATURE_##KERNELS)) left_out(#word, "no texture is one");
    CRT_PATTERN_LIST(CRT_LEFT_OUT_PATTERN)
#undef CRT_LEFT_OUT_PATTERN
    if (has(CRT_FEATURE_TEXTURE) && !has(CRT_FEATURE_FACTOR))
        left_out("factors of images", "no image is multiplied by another value");
    if (!has(CRT_FEATURE_DISPERSION))
        left_out("hero wavelength selection", "no index of refraction depends on wavelength");
    if (!has(CRT_FEATURE_MEDIA)) left_out("absorption", "no body absorbs");
    if (!has(CRT_FEATURE_MIX)) left_out("mixes of materials", "no material is made of others");
    if (!has(CRT_FEATURE_OPACITY)) left_out("surfaces that rays may pass", "all materials are opaque");
    if (!has(CRT_FEATURE_NORMAL_MAP)) left_out("normal maps", "no material has one");
    if (!has(CRT_FEATURE_THIN_FILM)) left_out("thin films", "no surface has one");
    if (!has(CRT_FEATURE_COAT_TEXTURE))
        left_out("gloss of varying roughness",
                 "the roughness of gloss and of coats does not depend on the place");
    if (!has(CRT_FEATURE_TINT)) left_out("tints", "what is mirrored has the colours of Fresnel's equations");
    if (!has(CRT_FEATURE_TRANSLUCENT))
        left_out("translucent sheets", "no surface scatters light to its other side");
    if (!has(CRT_FEATURE_CLEARCOAT)) left_out("coats", "no surface has one on top");
    if (!has(CRT_FEATURE_FUZZ)) left_out("fuzz", "no surface has any");
    if (!has(CRT_FEATURE_ROUGH_BASE)) left_out("rough diffuse bases", "all are Lambert's");
    if (!has(CRT_FEATURE_ANISOTROPY)) left_out("anisotropy", "all surfaces are isotropic");
    if (!has(CRT_FEATURE_SHAPES)) left_out("spheres, disks and cylinders", "all surfaces are triangles");
    if (!has(CRT_FEATURE_INSTANCES)) left_out("instances", "every triangle is stored where it stands");
    if (!has(CRT_FEATURE_SMOOTH_NORMALS)) left_out("shading normals", "all faces are flat");
    if (!has(CRT_FEATURE_AREA_LIGHT)) left_out("emission from surfaces", "nothing emits");
    if (!has(CRT_FEATURE_EMISSION_IMAGE)) left_out("emission by place", "no emission is an image");
    if (!has(CRT_FEATURE_NEE))
        left_out("light sampling and shadow rays",
                 !header.nee ? "integrator.nee is false"
                             : "no surface that scatters in all directions can be lit by an emitter");
    if (!has(CRT_FEATURE_ENVIRONMENT)) left_out("environment", "there is none");
    if (has(CRT_FEATURE_ENVIRONMENT) && !has(CRT_FEATURE_ENVIRONMENT_IMAGE))
        left_out("environment image", "the environment is the same in every direction");
    if (has(CRT_FEATURE_ENVIRONMENT) && !has(CRT_FEATURE_ENVIRONMENT_LIGHT))
        left_out("light sampling of the environment",
                 header.environment_light == 0 ? "environment.light_sampling is false"
                                               : "no surface needs light sampling");
    if (!has(CRT_FEATURE_POINT_LIGHT))
        left_out("lights without a surface",
                 header.point_lights.count == 0 ? "there are none"
                                                : "no surface needs light sampling");
    if (!has(CRT_FEATURE_LIGHT_TREE))
        left_out("a tree of lights", fmt::format("fewer than {} lights lie at a place", kLightTreeLights));
    if (!has(CRT_FEATURE_LENS)) left_out("thin lens", "the camera is a pinhole");
    if (!has(CRT_FEATURE_FILTER)) left_out("pixel filter table", "the box filter is the pixel itself");
    if (!has(CRT_FEATURE_AOV))
        left_out("AOV buffers", "no output asks for first-hit AOVs or for color_error");
    if (!has(CRT_FEATURE_REPLICATES))
        left_out("replicates", !isOfLight(scene) ? "integrator.type is a view" : "sampler.replicates is 1");
    if (!has(CRT_FEATURE_SPECTRAL_FILM))
        left_out("spectral film", !isOfLight(scene) ? "integrator.type is a view"
                                                 : "the film has neither bins nor responses");
    if (!has(CRT_FEATURE_VIEW)) left_out("normals and bounding-box views", "integrator.type is not a view");
    if (!has(CRT_FEATURE_SPLAT)) left_out("splats", "samples add to their own pixels alone");
    for (const auto& [feature, name] : {std::pair{CRT_FEATURE_SOBOL, "Sobol sampler"},
                                        std::pair{CRT_FEATURE_INDEPENDENT, "independent sampler"},
                                        std::pair{CRT_FEATURE_XORSHIFT, "xorshift sampler"}})
        if (!has(feature)) left_out(name, "sampler.type differs");
    return all;
}

std::string featureNames(std::uint64_t mask) {
    std::string names;
#define CRT_FEATURE_NAME(bit, name, text) \
    if (mask & (1ul << bit)) names += (names.empty() ? "" : ", ") + std::string(#name);
    CRT_FEATURE_LIST(CRT_FEATURE_NAME)
#undef CRT_FEATURE_NAME
    std::transform(names.begin(), names.end(), names.begin(),
                   [](char c) { return c == '_' ? '-' : static_cast<char>(std::tolower(c)); });
    return names;
}

}  // namespace crt
