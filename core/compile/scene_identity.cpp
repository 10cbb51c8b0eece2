#include "compile/scene_identity.h"

#include "base/byte_hash.h"
#include "kernel/dialect/bits_version.h"

#include <cstddef>
#include <cstdint>

namespace crt {
namespace {

class IdentityHash {
public:
    /// The size goes first: otherwise an item could move from one array to the next unseen.
    void add(const void* items, std::size_t count, std::size_t item_bytes) {
        const std::uint64_t sizes[] = {count, item_bytes};
        hash_.add(sizes, sizeof sizes);
        if (count > 0) hash_.add(items, count * item_bytes);
    }
    std::string digits() const { return hash_.digits128(); }

private:
    ByteHash hash_;
};

/// The header without what names accelerators and kernels, and without places in the blob. Every member of
/// CrtScene belongs to the identity until it is cleared here: a setting that was forgotten would mix films.
kernel::CrtScene settingsOf(kernel::CrtScene header) {
    header.features = 0;
    header.accelerator = 0;
    for (kernel::CrtSpan* span :
         {&header.triangles,         &header.faces,         &header.triangles8, &header.occluders8,
          &header.primitives,        &header.normals,       &header.textures,   &header.uvs,
          &header.vertex_colors,     &header.nodes,         &header.objects,    &header.materials,
          &header.compositions,      &header.layers,        &header.lights,     &header.point_lights,
          &header.environment_image, &header.spectral_film, &header.losses,     &header.spectra,
          &header.observer,          &header.wavelengths,   &header.filter,     &header.shapes,
          &header.instances,         &header.mesh_nodes,    &header.media})
        *span = {};
    return header;
}

}  // namespace

std::string sceneIdentity(const unsigned char* blob, const std::vector<std::array<float, 9>>& positions) {
    using namespace kernel;
    const CrtScene& header = *reinterpret_cast<const CrtScene*>(blob);
    IdentityHash hash;
    const std::uint32_t bits_version = CRT_BITS_VERSION;
    hash.add(&bits_version, 1, sizeof bits_version);
    const CrtScene settings = settingsOf(header);
    hash.add(&settings, 1, offsetof(CrtScene, patches));  // behind them there are places in the blob, and:
    if (settings.splat_scale != 0) hash.add(&settings.splat_scale, 1, sizeof settings.splat_scale);
    hash.add(positions.data(), positions.size(), sizeof positions[0]);
    hash.add(CRT_ARRAY(CrtPrimitive, blob, header.primitives), header.primitives.count,
             sizeof(CrtPrimitive));
    hash.add(CRT_ARRAY(CrtNormals, blob, header.normals), header.normals.count, sizeof(CrtNormals));
    hash.add(CRT_ARRAY(CrtMaterial, blob, header.materials), header.materials.count, sizeof(CrtMaterial));
    hash.add(CRT_ARRAY(CrtValue, blob, header.media), header.media.count, sizeof(CrtValue));
    if (header.compositions.count > 0)
        hash.add(CRT_ARRAY(CrtComposition, blob, header.compositions), header.compositions.count,
                 sizeof(CrtComposition));
    if (header.layers.count > 0)
        hash.add(CRT_ARRAY(CrtLayers, blob, header.layers), header.layers.count, sizeof(CrtLayers));
    if (header.shapes.count > 0)
        hash.add(CRT_ARRAY(CrtShape, blob, header.shapes), header.shapes.count, sizeof(CrtShape));
    if (header.instances.count > 0) {
        const CrtInstance* instances = CRT_ARRAY(CrtInstance, blob, header.instances);
        for (std::uint32_t i = 0; i < header.instances.count; ++i) {
            CrtInstance instance = instances[i];
            instance.root = 0;
            hash.add(&instance, 1, sizeof instance);
        }
        // Every backend has the same trees of meshes, and so their triangles in the same order.
        hash.add(CRT_ARRAY(CrtTriangle, blob, header.triangles) + header.triangle_count,
                 header.triangles.count - header.triangle_count, sizeof(CrtTriangle));
    }
    // A texture names its texels, or its numbers, by their place in the blob.
    const CrtTexture* textures = CRT_ARRAY(CrtTexture, blob, header.textures);
    for (std::uint32_t i = 0; i < header.textures.count; ++i) {
        CrtTexture texture = textures[i];
        hash.add(CRT_ARRAY(u16, blob, texture.words), texture.words.count, sizeof(u16));
        texture.words = {};
        hash.add(&texture, 1, sizeof texture);
    }
    // The losses follow from the materials; a record names its rows by their place in the blob.
    const CrtLoss* losses = CRT_ARRAY(CrtLoss, blob, header.losses);
    for (std::uint32_t i = 0; i < header.losses.count; ++i)
        hash.add(CRT_ARRAY(f32, blob, losses[i].rows), losses[i].rows.count, sizeof(f32));
    hash.add(CRT_ARRAY(CrtUvs, blob, header.uvs), header.uvs.count, sizeof(CrtUvs));
    hash.add(CRT_ARRAY(CrtVertexColors, blob, header.vertex_colors), header.vertex_colors.count,
             sizeof(CrtVertexColors));
    hash.add(CRT_ARRAY(f32, blob, header.spectra), header.spectra.count, CRT_SPECTRUM_STRIDE * sizeof(f32));
    hash.add(CRT_ARRAY(f32, blob, header.observer), header.observer.count, sizeof(f32));
    hash.add(CRT_ARRAY(f32, blob, header.wavelengths), header.wavelengths.count, sizeof(f32));
    hash.add(CRT_ARRAY(f32, blob, header.filter), header.filter.count, sizeof(f32));

    // A light names its triangle by the place that the tree gave it.
    const CrtLight* lights = CRT_ARRAY(CrtLight, blob, header.lights);
    const CrtTriangle* triangles = CRT_ARRAY(CrtTriangle, blob, header.triangles);
    std::vector<CrtLight> by_id(lights, lights + header.lights.count);
    for (CrtLight& light : by_id)
        if (light.kind == CRT_LIGHT_TRIANGLE || light.kind == CRT_LIGHT_PARALLELOGRAM ||
            light.kind == CRT_LIGHT_SHAPE)
            light.slot = triangles[light.slot].id;
    hash.add(by_id.data(), by_id.size(), sizeof(CrtLight));
    const CrtPointLight* point_lights = CRT_ARRAY(CrtPointLight, blob, header.point_lights);
    std::vector<CrtPointLight> without_places(point_lights, point_lights + header.point_lights.count);
    for (CrtPointLight& light : without_places) light.form = {};
    hash.add(without_places.data(), without_places.size(), sizeof(CrtPointLight));
    for (std::uint32_t i = 0; i < header.point_lights.count; ++i) {
        if (point_lights[i].form.count == 0) continue;
        CrtLightForm form = *CRT_ARRAY(CrtLightForm, blob, point_lights[i].form);
        for (CrtSpan* span : {&form.vertical, &form.horizontal, &form.shares}) {
            hash.add(CRT_ARRAY(f32, blob, *span), span->count, sizeof(f32));
            *span = {};
        }
        hash.add(&form, 1, sizeof form);
    }
    if (header.environment_image.count > 0) {
        CrtEnvironmentImage image = *CRT_ARRAY(CrtEnvironmentImage, blob, header.environment_image);
        hash.add(CRT_ARRAY(CrtEnvironmentTexel, blob, image.texels), image.texels.count,
                 sizeof(CrtEnvironmentTexel));
        hash.add(CRT_ARRAY(u32, blob, image.rows), image.rows.count, sizeof(u32));
        hash.add(CRT_ARRAY(u32, blob, image.columns), image.columns.count, sizeof(u32));
        image.texels = image.rows = image.columns = {};
        hash.add(&image, 1, sizeof image);
    }
    if (header.spectral_film.count > 0) {
        CrtSpectralFilm film = *CRT_ARRAY(CrtSpectralFilm, blob, header.spectral_film);
        hash.add(CRT_ARRAY(f32, blob, film.responses), film.responses.count,
                 CRT_SPECTRUM_STRIDE * sizeof(f32));
        film.responses = {};
        hash.add(&film, 1, sizeof film);
    }
    return hash.digits();
}

}  // namespace crt
