#include "compile/compile.h"

#include "base/log.h"
#include "base/stage.h"
#include "base/stopwatch.h"
#include "compile/accelerator.h"
#include "compile/blob_writer.h"
#include "compile/camera_media.h"
#include "compile/distributions.h"
#include "compile/environment_image.h"
#include "compile/flatten.h"
#include "compile/geometry.h"
#include "compile/instances.h"
#include "compile/large_surfaces.h"
#include "compile/lights.h"
#include "compile/materials.h"
#include "compile/near_pairs.h"
#include "compile/near_scene.h"
#include "compile/near_surfaces.h"
#include "compile/needs.h"
#include "compile/point_lights.h"
#include "compile/scene_identity.h"
#include "compile/settings.h"
#include "compile/spectral_film.h"
#include "compile/spectrum_table.h"
#include "compile/textures.h"
#include "compile/touching_media.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace crt {
namespace {

/// Triangles and shapes of the scene, and triangles of the meshes that are instanced.
std::size_t primitivesOf(const FlatScene& flat) {
    std::size_t primitives = flat.firstInstance();
    for (const InstancedMesh& mesh : flat.meshes) primitives += mesh.flat.triangles.size();
    return primitives;
}

std::size_t smoothTrianglesOf(const FlatScene& flat) {
    std::size_t smooth = flat.smooth_triangles;
    for (const InstancedMesh& mesh : flat.meshes) smooth += mesh.flat.smooth_triangles;
    return smooth;
}

/// Number of records of a kind of the scene and its meshes: one for each primitive, or none.
template <class T>
std::size_t recordsOf(const FlatScene& flat, std::vector<T> FlatScene::*member) {
    std::size_t records = (flat.*member).size();
    for (const InstancedMesh& mesh : flat.meshes) records += (mesh.flat.*member).size();
    return records;
}

/// Records of the scene and its meshes for each primitive.
template <class T>
kernel::CrtSpan appendOfPrimitives(BlobWriter& blob, const FlatScene& flat,
                                   std::vector<T> FlatScene::*member) {
    if (recordsOf(flat, member) == 0) return {0, 0};
    return blob.appendFilled<T>(primitivesOf(flat), [&](std::span<T> all) {
        auto next = std::copy((flat.*member).begin(), (flat.*member).end(), all.begin());
        for (const InstancedMesh& mesh : flat.meshes)
            next = std::copy((mesh.flat.*member).begin(), (mesh.flat.*member).end(), next);
    });
}

/// For what grows with the number of triangles, and some tables.
std::size_t expectedBytes(const FlatScene& flat, const AcceleratorPart& accelerator,
                          const MeshTrees& trees) {
    constexpr std::size_t kTables = std::size_t{1} << 20;
    return kTables + (accelerator.nodes.size() + trees.nodes.size()) * sizeof(kernel::CrtNode4) +
           flat.instances.size() * sizeof(kernel::CrtInstance) +
           (primitivesOf(flat) + flat.instances.size()) *
               (sizeof(kernel::CrtTriangle) + sizeof(kernel::CrtFace) + sizeof(kernel::CrtPrimitive)) +
           smoothTrianglesOf(flat) * sizeof(kernel::CrtNormals) +
           recordsOf(flat, &FlatScene::uvs) * sizeof(kernel::CrtUvs) +
           recordsOf(flat, &FlatScene::colors) * sizeof(kernel::CrtVertexColors);
}

/// Warns of lights that nothing in the scene can show.
void warnOfUnseenLights(const Scene& scene, const kernel::CrtScene& header) {
    if (header.point_lights.count == 0 || (header.features & CRT_FEATURE_POINT_LIGHT) != 0) return;
    logWarning(
        "{}: nothing scatters their light: mirrors, smooth metals and glass do not show point, spot and "
        "directional lights{}",
        scene.file,
        scene.integrator.max_depth == 0 ? ", and 'max_depth: 0' shows no illuminated surfaces" : "");
}

/// From part to part: each function takes parts of the scene, or what was made of them, and returns a part
/// of the blob. Nothing is changed by two of them.
CompiledScene compileParts(const Scene& scene, std::uint32_t aovs, const CompileOptions& options) {
    const Stage stage("compiling the scene");
    const Stopwatch compiling;
    const FlatScene flat = flattenScene(scene);
    kernel::CrtScene header = compileSettings(scene, flat, aovs);
    BlobWriter blob;

    AcceleratorPart accelerator = compileAccelerator(scene, flat, options);
    const std::vector<const Material*> used = usedMaterials(scene, flat);
    const std::vector<TextureIndex> textures = usedTextures(scene, used);
    const MeshTrees trees = compileMeshTrees(flat);
    blob.reserve(expectedBytes(flat, accelerator, trees) + texelBytes(scene, textures));
    header.accelerator = accelerator.kind;
    header.nodes = blob.append(accelerator.nodes);
    accelerator.nodes = {};  // they are not needed again, and they may be hundreds of megabytes
    const std::size_t count = flat.triangles.size();
    header.triangle_count = static_cast<std::uint32_t>(count);
    const std::size_t primitive_count = primitivesOf(flat), slots = primitive_count + flat.instances.size();
    header.triangles = blob.appendFilled<kernel::CrtTriangle>(slots, [&](auto triangles) {
        compileTriangles(flat, accelerator, triangles.first(count));
        compileMeshTriangles(flat, trees, triangles);
    });
    header.faces = blob.appendFilled<kernel::CrtFace>(
        count, [&](auto faces) { compileFaces(flat, accelerator, faces); });
    std::size_t occluders = 0;
    const bool shows_boxes = !tracesSurfaces(scene.integrator.type);
    if (accelerator.kind == CRT_ACCELERATOR_BRUTE_FORCE && !shows_boxes) {
        const std::vector<std::uint32_t> all = trianglesOf(flat);
        const std::vector<std::uint32_t> occluding = shadowRaysLeave(scene) ? all : occludersOf(flat);
        occluders = occluding.size();
        header.triangles8 = blob.append(compileTriangles8(flat, all));
        header.occluders8 = blob.append(compileTriangles8(flat, occluding));
        header.patches = blob.append(compilePatches(flat, all));
        header.occluder_patches = blob.append(compilePatches(flat, occluding));
    }
    if (accelerator.kind == CRT_ACCELERATOR_AABB || shows_boxes)
        header.objects = blob.append(compileObjects(flat));

    const std::vector<std::uint32_t> emitting = emittingTriangles(scene, flat);
    const MaterialTables tables = materialTablesOf(used);
    SpectrumTable spectra;

    std::optional<EnvironmentTexels> around;
    if (spectrumOfEnvironment(scene) && scene.environment->dependsOnDirection()) {
        around = environmentTexels(*scene.environment);
        header.environment_image = appendEnvironmentImage(blob, *scene.environment, *around);
    }
    LightPart lights =
        compileLights(scene, flat, emitting, accelerator, spectra, around ? &*around : nullptr, textures);
    appendForms(scene, flat, blob, lights.point_lights);
    header.lights = appendLights(lights, blob);
    header.tree_lights = lights.tree_lights;
    header.environment_light = lights.environment;
    header.point_lights = blob.append(lights.point_lights);
    if (splats(scene.integrator.type)) header.splat_scale = splatScale(lights.power);
    if (lights.lights.empty() && !scene.environment && measuresLight(scene.integrator.type))
        logWarning(
            "the scene has no light: the image will be black "
            "(add emission to an object, lights, or an environment)");

    TexturePart texture_part = compileTextures(scene, textures, spectra, blob);
    header.textures = blob.append(texture_part.records);
    const MaterialPart materials = compileMaterials(used, tables, spectra, texture_part);
    // Behind the spectra of all materials.
    const Spectrum* environment = spectrumOfEnvironment(scene);
    header.environment = environment ? spectra.valueOf(*environment) : CRT_NONE;
    if (lights.environment > 0)
        blob.items<kernel::CrtLight>(header.lights)[lights.environment - 1].radiance = header.environment;
    if (header.textures.count > 0 || (materials.features & CRT_FEATURE_ANISOTROPY) != 0)
        header.uvs = appendOfPrimitives(blob, flat, &FlatScene::uvs);
    if (header.textures.count > 0) header.vertex_colors = appendOfPrimitives(blob, flat, &FlatScene::colors);
    header.primitives = blob.appendFilled<kernel::CrtPrimitive>(primitive_count, [&](auto primitives) {
        compilePrimitives(flat, scene.materials.size(), lights.light_of, 0,
                          primitives.first(flat.firstInstance()));
        std::size_t first = flat.firstInstance(), normals = flat.smooth_triangles;
        for (const InstancedMesh& mesh : flat.meshes) {
            compilePrimitives(mesh.flat, scene.materials.size(), {}, static_cast<std::uint32_t>(normals),
                              primitives.subspan(first, mesh.flat.triangles.size()));
            first += mesh.flat.triangles.size();
            normals += mesh.flat.smooth_triangles;
        }
    });
    header.normals = blob.appendFilled<kernel::CrtNormals>(smoothTrianglesOf(flat), [&](auto normals) {
        flattenNormals(scene, flat, normals.first(flat.smooth_triangles));
        std::size_t first = flat.smooth_triangles;
        for (const InstancedMesh& mesh : flat.meshes) {
            flattenNormals(scene, mesh.flat, normals.subspan(first, mesh.flat.smooth_triangles));
            first += mesh.flat.smooth_triangles;
        }
    });
    header.mesh_nodes = blob.append(trees.nodes);
    header.instances = blob.append(compileInstances(flat, trees));
    header.materials = blob.append(materials.records);
    header.media = blob.append(materials.media);
    header.medium_bits = mediumBits(materials.media.size());
    header.compositions = blob.append(compileCompositions(used, texture_part));
    header.layers = blob.append(materials.layers);
    header.losses = appendLosses(blob, tables.compensations);

    header.spectra = blob.append(spectra.floats());
    header.spectra.count = spectra.count();
    header.observer = blob.append(observerTable(CRT_SPECTRUM_STRIDE));
    const bool measures_spectra = spectralChannelsOf(scene).count() > 0;
    header.wavelengths = blob.append(
        wavelengthTable(CRT_WAVELENGTH_TABLE, measures_spectra ? scene.film.spectral : SpectralFilm{}));
    if (measures_spectra)
        header.spectral_film = appendSpectralFilm(blob, scene.film.spectral, header.channels);
    header.filter = blob.append(filterTable(scene.film, CRT_FILTER_OCTAVES, CRT_FILTER_STEPS));
    header.shapes = blob.appendFilled<kernel::CrtShape>(flat.shapes.size(), [&](auto shapes) {
        std::transform(flat.shapes.begin(), flat.shapes.end(), shapes.begin(),
                       [](const FlatShape& shape) { return shape.record; });
    });

    header.features = featuresOf(scene, header, materials, texture_part, lights.features);
    warnOfUnseenLights(scene, header);
    decodeTextures(texture_part, blob);  // into the blob, which does not move any more

    CompiledScene out;
    out.blob = blob.finish(header);
    findCameraMedia(out.data());
    markTouchingMedia(out.data());
    out.size_bytes = out.blob.size() * sizeof(CompiledScene::Line);
    out.spectral_channels = spectralChannelsOf(scene).count();
    out.triangles = flat.firstShape();
    out.shapes = flat.shapes.size();
    out.instances = flat.instances.size();
    for (const InstancedMesh& mesh : flat.meshes) out.instanced_triangles += mesh.flat.triangles.size();
    out.emitters = lights.emitters;
    out.objects = flat.placements;
    out.nodes = header.nodes.count;
    out.images = texture_part.images.size();
    out.texel_bytes = texture_part.texel_bytes;
    out.scale_exponent = flat.scale_exponent;
    out.centre = flat.centre;
    out.camera_reach = std::numeric_limits<double>::infinity();
    if (flat.focus)
        out.camera_reach = 2 * length(scene.camera.position - flat.centre) + 64 * flat.focus->detail;
    out.without_nodes = accelerator.without_nodes;
    out.left_out = leftOut(scene, header, occluders, accelerator.without_nodes);
    out.hash = sceneIdentity(out.data(), flat.positions);
    out.build_seconds = accelerator.build_seconds;
    out.compile_seconds = compiling.seconds() - out.build_seconds;
    return out;
}

/// "'ceiling light'": what the author calls the object of a primitive.
std::string objectOf(const Scene& scene, const CompiledScene& compiled, std::uint32_t primitive) {
    using namespace kernel;
    std::uint32_t placement =
        CRT_ARRAY(CrtPrimitive, compiled.data(), compiled.header().primitives)[primitive].object &
        ~CRT_PRIMITIVE_TOUCHES;
    for (const Object& object : scene.objects) {
        if (placement < object.transforms.size())
            return object.name.empty() ? std::string("an object without a name")
                                       : fmt::format("'{}'", object.name);
        placement -= static_cast<std::uint32_t>(object.transforms.size());
    }
    return "a surface";
}

/// Warns of geometry that single precision cannot tell apart.
void warnOfNearSurfaces(const Scene& scene, const CompiledScene& compiled) {
    const Stage stage("looking for surfaces too near to each other");
    // Nearly all scenes without nodes need no search.
    const bool searches = !compiled.without_nodes || mayHaveNearSurfaces(compiled);
    std::optional<CompiledScene> reduced;
    if (searches && compiled.without_nodes) reduced = nearScene(compiled);
    const CompiledScene& searched = reduced ? *reduced : compiled;
    if (const auto found = searches ? findCoplanarLight(searched) : std::nullopt)
        logWarning(
            "{} lies in the plane of {} and overlaps it: rounding decides which of them is seen, and the "
            "image is wrong there; move the light {:.3g} or more towards the side that it lights, or cut a "
            "hole for it",
            objectOf(scene, compiled, found->light), objectOf(scene, compiled, found->surface),
            found->least_gap);
    if (const CoarseLights found = findCoarseLights(compiled); found.lights > 0)
        logWarning(
            "{} of {} lights are so small, and so far from where the camera is and looks, that rounding "
            "moves their edges by up to {:.1g} of their size: their light is wrong by the same factor; use "
            "point lights for them, or remove the distant objects",
            found.lights, found.asked, found.rounding);
    std::vector<Vec3d> lights;
    for (const PointLight& light : scene.point_lights)
        if (shinesFromPoint(light.type)) lights.push_back(light.position);
    if (const std::optional<LargeSurface> found = findLargeSurface(compiled, lights))
        logWarning(
            "{} is so large that rays leave it {:.2g} above the surface, and a light is {:.2g} away: the "
            "light there is wrong by up to some {:.{}f} %; use smaller triangles near the light, or a disk "
            "(crt divides a mesh that has one placement, does not emit and has no vertex colours)",
            objectOf(scene, compiled, found->surface), found->clearance, found->height,
            100 * found->error, found->error < 0.1 ? 1 : 0);
    if (searches && scene.integrator.max_depth > 0)
        if (const NearSurfaces found = findNearSurfaces(searched); found.near > 0)
            logWarning(
                "{} of {} triangles looked at have another surface nearer than single precision can tell "
                "for triangles of this size (up to {:.3g} "
                "apart): light between them may be lost; divide the larger triangles there, or move the "
                "surfaces apart or together",
                found.near, found.asked, found.nearest_clearance);
}

}  // namespace

CompiledScene compileScene(const Scene& scene, std::uint32_t aovs, const CompileOptions& options) {
    CompiledScene compiled = compileParts(scene, aovs, options);
    if (measuresLight(scene.integrator.type)) warnOfNearSurfaces(scene, compiled);
    return compiled;
}

}  // namespace crt
