#include "compile/materials.h"

#include "base/error.h"
#include "base/parallel.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace crt {
namespace {

/// Of faces that name no material.
const Material& fallbackMaterial() {
    static const Material grey = [] {
        Material material;
        material.reflectance = constantSpectrum(0.5);
        return material;
    }();
    return grey;
}

/// For a composed material, its parts carry the fuzz.
bool hasFuzz(const Material& material) { return material.fuzz > 0 && !material.isComposed(); }

/// True if a gloss or a coat of it has a roughness that depends on the place.
bool hasVaryingCoat(const Material& material) {
    return (material.type == MaterialType::Plastic && material.hasVaryingRoughness()) ||
           (hasClearcoat(material) &&
            (material.clearcoat->roughness_texture != kNoTexture || material.clearcoat->roughens));
}

/// True if the scene has the material of a triangle.
bool isKnown(const FlatTriangle& triangle, std::size_t scene_materials) {
    return triangle.material >= 0 && static_cast<std::size_t>(triangle.material) < scene_materials;
}

struct CoatValues {
    kernel::CrtValue internal, albedo;
};

CoatValues coatValuesOf(const Coat& coat, SpectrumTable& spectra) {
    return {valueOf(coat.internal_reflectance), spectra.valueOf(coat.albedo)};
}

CoatValues coatValuesOf(const VaryingCoat& coat, SpectrumTable& spectra) {
    return {spectra.valueOf(std::vector{coat.internal_reflectance}), spectra.valueOf(coat.albedos)};
}

kernel::CrtMaterial recordOf(const Material& material, const MaterialTables& tables,
                             SpectrumTable& spectra, const TexturePart& textures) {
    const auto reflectance = [&] {
        return material.reflectance_texture != kNoTexture ? textures.valueOf(material.reflectance_texture)
                                                          : spectra.valueOf(material.reflectance);
    };
    const auto roughness = [&] {
        return material.roughness_texture != kNoTexture ? textures.valueOf(material.roughness_texture)
                                                        : valueOf(material.roughness);
    };
    kernel::CrtMaterial record{};
    record.type = static_cast<std::uint32_t>(material.type);
    if (material.isClear()) record.flags = CRT_MATERIAL_TRANSMITS;
    if (material.isTranslucent()) record.flags |= CRT_MATERIAL_TRANSLUCENT;
    if (hasClearcoat(material) && material.clearcoat->roughens) record.flags |= CRT_MATERIAL_UNDER_COAT;
    if (material.isTinted()) record.flags |= CRT_MATERIAL_TINTED;
    const auto losses = tables.compensations.table_of.find(&material);
    if (losses != tables.compensations.table_of.end()) record.loss = losses->second;
    if (const Anisotropy a = anisotropyOf(material); a.narrowing > 0) {
        const double turn = material.anisotropy_rotation_deg * (std::numbers::pi / 180);
        record.widening = static_cast<float>(a.widening);
        record.narrowing = static_cast<float>(a.narrowing);
        record.turn_cos = static_cast<float>(std::cos(turn));
        record.turn_sin = static_cast<float>(std::sin(turn));
    }
    switch (material.type) {
        case MaterialType::Diffuse:
        case MaterialType::Mirror: record.of.diffuse.reflectance = reflectance(); break;
        case MaterialType::RoughConductor:
            record.roughness = roughness();
            if (material.by_color) {
                record.flags |= CRT_MATERIAL_OPENPBR;
                record.of.metal.eta = reflectance();
                record.of.metal.k = spectra.valueOf(material.edge_tint);
                record.of.metal.factor = valueOf(material.weight);
                break;
            }
            [[fallthrough]];
        case MaterialType::Conductor:
            record.of.metal.eta = spectra.valueOf(material.eta);
            record.of.metal.k = spectra.valueOf(material.k);
            if (material.type == MaterialType::RoughConductor)
                record.of.metal.mean = spectra.valueOf(tables.compensations.mean_reflectance.at(&material));
            break;
        case MaterialType::RoughDielectric: record.roughness = roughness(); [[fallthrough]];
        case MaterialType::Dielectric:
            record.of.glass.eta = spectra.valueOf(material.eta);
            if (!material.eta.isConstant()) record.flags |= CRT_MATERIAL_DISPERSIVE;
            if (material.absorption) spectra.valueOf(*material.absorption);  // for numberMedia()
            break;
        case MaterialType::ThinDielectric: record.of.glass.eta = spectra.valueOf(material.eta); break;
        case MaterialType::Mix:
        case MaterialType::TwoSided: return {};
        case MaterialType::Plastic: {
            record.of.plastic.reflectance = reflectance();
            record.of.plastic.eta = spectra.valueOf(material.eta);
            record.roughness = roughness();
            const CoatValues coat = material.hasVaryingRoughness()
                                        ? coatValuesOf(varyingCoatOf(tables.coats, material.eta[0]), spectra)
                                        : coatValuesOf(coatOf(tables.coats, material), spectra);
            record.of.plastic.internal = coat.internal;
            record.of.plastic.coat = coat.albedo;
            if (material.by_color) record.flags |= CRT_MATERIAL_OPENPBR;
            break;
        }
    }
    if (hasThinFilm(material)) {
        record.film_scale = static_cast<float>(material.film_thickness_nm);
        record.film_thickness =
            material.film_texture != kNoTexture ? textures.valueOf(material.film_texture) : valueOf(1);
        record.film_index = spectra.valueOf(material.film_index);
    }
    return record;
}

kernel::CrtLayers layersOf(const Material& material, const MaterialTables& tables, SpectrumTable& spectra,
                           const TexturePart& textures) {
    kernel::CrtLayers record{};
    if (hasFuzz(material)) {
        record.fuzz_weight = static_cast<float>(material.fuzz);
        record.fuzz_roughness = static_cast<float>(material.fuzz_roughness);
        record.fuzz_color = spectra.valueOf(material.fuzz_color);
    }
    if (hasClearcoat(material)) {
        const Clearcoat& coat = *material.clearcoat;
        const bool varies = coat.roughness_texture != kNoTexture,
                   base_varies = material.roughness_texture != kNoTexture;
        record.clear_ior = static_cast<float>(coat.ior);
        record.clear_roughness = varies ? textures.valueOf(coat.roughness_texture) : valueOf(coat.roughness);
        record.clear_depth = spectra.valueOf(coat.depth);
        const CoatValues values = varies ? coatValuesOf(varyingCoatOf(tables.coats, coat.ior), spectra)
                                         : coatValuesOf(coatOf(tables.coats, coat), spectra);
        record.clear_albedo = values.albedo;
        record.clear_internal = values.internal;
        record.clear_darkening = static_cast<float>(coat.darkening);
        record.clear_base =
            base_varies ? textures.valueOf(material.roughness_texture) : valueOf(coat.base_roughness);
        record.clear_base_share = base_varies ? static_cast<float>(coat.base_share) : 1;
    }
    if (material.isTinted())
        record.tint = material.tint_texture != kNoTexture ? textures.valueOf(material.tint_texture)
                                                          : spectra.valueOf(*material.tint);
    if (material.isTranslucent())
        record.transmittance = material.transmittance_texture != kNoTexture
                                   ? textures.valueOf(material.transmittance_texture)
                                   : spectra.valueOf(*material.transmittance);
    if (hasRoughBase(material)) {
        const RoughBase& base = tables.rough_bases.at(&material);
        record.base_loss = spectra.valueOf(base.loss);
        record.base_roughness = static_cast<float>(material.diffuse_roughness);
        record.base_scale = static_cast<float>(1 / base.most);
        record.base_mean = static_cast<float>(base.mean);
    }
    return record;
}

}  // namespace

std::vector<const Material*> usedMaterials(const Scene& scene, const FlatScene& flat) {
    const std::size_t count = scene.materials.size();
    std::vector<bool> used(count + 1, false);
    const auto use = [&](const FlatScene& part) {
        for (std::size_t i = 0; i < part.firstInstance(); ++i)
            used[isKnown(part.triangles[i], count) ? static_cast<std::size_t>(part.triangles[i].material)
                                                   : count] = true;
    };
    use(flat);
    for (const InstancedMesh& mesh : flat.meshes) use(mesh.flat);
    // Composed materials come in any order.
    for (int depth = 0; depth < kDeepestComposition + kDeepestOpenPbr; ++depth)
        for (std::size_t i = 0; i < count; ++i)
            if (used[i] && scene.materials[i].isComposed())
                for (const std::int32_t part : scene.materials[i].parts)
                    used[static_cast<std::size_t>(part)] = true;
    const bool scattered = measuresLight(scene.integrator.type);
    std::vector<const Material*> materials;
    for (std::size_t i = 0; i < count; ++i)
        materials.push_back(used[i] && scattered ? &scene.materials[i] : nullptr);
    if (used[count] || count == 0) materials.push_back(scattered ? &fallbackMaterial() : nullptr);
    return materials;
}

TableWork tableWorkOf(const std::vector<const Material*>& materials) {
    TableWork work;
    countCoats(materials, work);
    countRoughBases(materials, work);
    countCompensations(materials, work);
    return work;
}

MaterialTables materialTablesOf(const std::vector<const Material*>& materials) {
    tableWorkOf(materials).requireBounded();
    Coats coats = coatsOf(materials);
    RoughBases rough_bases = roughBasesOf(materials, coats);
    return {std::move(coats), compensationsOf(materials), std::move(rough_bases)};
}

namespace {

/// The glass behind the surface of a material or of a mix; null if there is none.
/// All glass of a mix has the same inside (MaterialReader::checkInsides).
const Material* glassOf(const Material& material, const std::vector<const Material*>& materials) {
    if (material.type == MaterialType::Dielectric || material.type == MaterialType::RoughDielectric)
        return &material;
    if (material.type != MaterialType::Mix) return nullptr;
    for (const std::int32_t part : material.parts)
        if (const Material* glass = glassOf(*materials[static_cast<std::size_t>(part)], materials))
            return glass;
    return nullptr;
}

/// Numbers the media that the surfaces of the materials bound. Without absorption and holes there are no
/// numbers, because no ray needs them. Media that absorb equally share a number. Each medium with holes has
/// its own, so that a ray can tell whether it entered through a hole.
void numberMedia(const std::vector<const Material*>& materials, SpectrumTable& spectra,
                 MaterialPart& part) {
    std::map<std::pair<kernel::CrtValue, std::size_t>, std::uint32_t> numbers;
    bool matter = false;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        const Material* glass = materials[i] ? glassOf(*materials[i], materials) : nullptr;
        if (!glass) continue;
        const kernel::CrtValue absorption = glass->absorption ? spectra.valueOf(*glass->absorption) : 0;
        const bool holes = !materials[i]->isOpaque();
        matter |= absorption != 0 || holes;
        const auto [found, fresh] = numbers.try_emplace({absorption, holes ? i + 1 : 0},
                                                        static_cast<std::uint32_t>(part.media.size() + 1));
        if (fresh) part.media.push_back(absorption);
        part.records[i].medium = found->second;
    }
    if (!matter) {
        part.media.clear();
        for (kernel::CrtMaterial& record : part.records) record.medium = 0;
        return;
    }
    if (part.media.size() >= std::size_t{1} << 16)
        throw Error(ErrorKind::Scene,
                    fmt::format("{} glass materials absorb differently or have holes; crt supports up to "
                                "65535",
                                part.media.size()));
    part.features |= CRT_FEATURE_MEDIA;
}

}  // namespace

std::uint32_t mediumBits(std::size_t media) {
    return media == 0 ? 0 : std::bit_ceil(static_cast<std::uint32_t>(std::bit_width(media)));
}

MaterialPart compileMaterials(const std::vector<const Material*>& materials, const MaterialTables& tables,
                              SpectrumTable& spectra, const TexturePart& textures) {
    MaterialPart part;
    bool has_layers = false;
    for (const Material* material : materials) {
        kernel::CrtMaterial& record = part.records.emplace_back();
        kernel::CrtLayers& layers = part.layers.emplace_back();
        if (!material) continue;
        record = recordOf(*material, tables, spectra, textures);
        layers = layersOf(*material, tables, spectra, textures);
        has_layers |= hasFuzz(*material) || hasClearcoat(*material) || hasRoughBase(*material) ||
                      material->isTinted() || material->isTranslucent();
        if (!material->isOpaque()) part.features |= CRT_FEATURE_OPACITY;
        if (material->normal_texture != kNoTexture) part.features |= CRT_FEATURE_NORMAL_MAP;
        if (material->isComposed()) {
            part.features |= CRT_FEATURE_MIX;
            continue;
        }
        part.features |= 1ul << record.type;
        if ((record.flags & CRT_MATERIAL_DISPERSIVE) != 0) part.features |= CRT_FEATURE_DISPERSION;
        if (record.film_thickness != 0) part.features |= CRT_FEATURE_THIN_FILM;
        if (record.narrowing > 0) part.features |= CRT_FEATURE_ANISOTROPY;
        if (hasFuzz(*material)) part.features |= CRT_FEATURE_FUZZ;
        if (hasClearcoat(*material)) part.features |= CRT_FEATURE_CLEARCOAT;
        if (material->isTinted()) part.features |= CRT_FEATURE_TINT;
        if (material->isTranslucent()) part.features |= CRT_FEATURE_TRANSLUCENT;
        // Mapped normals of a sheet are as interpolated ones.
        if (material->isTranslucent() && material->normal_texture != kNoTexture)
            part.features |= CRT_FEATURE_SMOOTH_NORMALS;
        if (hasVaryingCoat(*material)) part.features |= CRT_FEATURE_COAT_TEXTURE;
        if (hasRoughBase(*material)) part.features |= CRT_FEATURE_ROUGH_BASE;
    }
    if (!has_layers) part.layers.clear();
    numberMedia(materials, spectra, part);
    return part;
}

std::vector<kernel::CrtComposition> compileCompositions(const std::vector<const Material*>& materials,
                                                        const TexturePart& textures) {
    const auto number = [&](double value, TextureIndex texture) {
        return texture != kNoTexture ? textures.valueOf(texture) : valueOf(value);
    };
    std::vector<kernel::CrtComposition> records;
    bool needed = false;
    for (const Material* material : materials) {
        kernel::CrtComposition record{};
        record.opacity = CRT_OPAQUE;
        if (material) {
            record.opacity = number(material->opacity, material->opacity_texture);
            if (material->isComposed()) {
                record.kind = material->type == MaterialType::Mix ? CRT_COMPOSED_MIX : CRT_COMPOSED_SIDES;
                record.first = static_cast<std::uint32_t>(material->parts[0]);
                record.second = static_cast<std::uint32_t>(material->parts[1]);
            }
            if (material->type == MaterialType::Mix)
                record.amount = number(material->amount, material->amount_texture);
            const bool mapped = material->normal_texture != kNoTexture;
            if (mapped) {
                record.normal_map = textures.valueOf(material->normal_texture);
                record.normal_strength = static_cast<float>(material->normal_strength);
                record.walled = !material->transmits();
            }
            needed |= mapped || material->isComposed() || !material->isOpaque();
        }
        records.push_back(record);
    }
    if (!needed) records.clear();
    return records;
}

void compilePrimitives(const FlatScene& flat, std::size_t scene_materials,
                       const std::vector<std::uint32_t>& light_of, std::uint32_t first_normals,
                       std::span<kernel::CrtPrimitive> primitives) {
    constexpr std::size_t kPart = std::size_t{1} << 16;
    std::vector<std::uint32_t> first_normal(partsOf(primitives.size(), kPart));
    parallelFor(primitives.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) first_normal[first / kPart] += flat.triangles[i].smooth;
    });
    std::uint32_t before = first_normals;
    for (std::uint32_t& normals : first_normal) before += std::exchange(normals, before);
    parallelFor(primitives.size(), kPart, [&](std::size_t first, std::size_t end) {
        std::uint32_t normal = first_normal[first / kPart];
        for (std::size_t i = first; i < end; ++i) {
            const FlatTriangle& t = flat.triangles[i];
            primitives[i].material =
                static_cast<std::uint32_t>(isKnown(t, scene_materials) ? t.material : scene_materials);
            primitives[i].light = light_of.empty() ? CRT_NONE : light_of[i];
            primitives[i].object = t.object;
            primitives[i].normals = t.smooth ? normal++ : CRT_NONE;
        }
    });
}

}  // namespace crt
