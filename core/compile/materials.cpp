#include "compile/materials.h"

#include "kernel/features.h"

#include <algorithm>

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

/// Whether the scene has the material that a triangle names.
bool isKnown(const FlatTriangle& triangle, std::size_t scene_materials) {
    return triangle.material >= 0 && static_cast<std::size_t>(triangle.material) < scene_materials;
}

std::vector<const Spectrum*> spectraOf(const Material& material) {
    switch (material.type) {
        case MaterialType::Diffuse:
        case MaterialType::Mirror: return {&material.reflectance};
        case MaterialType::Conductor: return {&material.eta, &material.k};
        case MaterialType::Dielectric: return {&material.eta};
    }
    return {};
}

kernel::CrtMaterial recordOf(const Material& material, const SpectrumTable& spectra) {
    kernel::CrtMaterial record{};
    record.type = static_cast<std::uint32_t>(material.type);
    switch (material.type) {
        case MaterialType::Diffuse:
        case MaterialType::Mirror: record.reflectance = spectra.valueOf(material.reflectance); break;
        case MaterialType::Conductor:
            record.eta = spectra.valueOf(material.eta);
            record.k = spectra.valueOf(material.k);
            break;
        case MaterialType::Dielectric:
            record.eta = spectra.valueOf(material.eta);
            if (!material.eta.isConstant()) record.flags = CRT_MATERIAL_DISPERSIVE;
    }
    return record;
}

}  // namespace

std::vector<const Material*> usedMaterials(const Scene& scene, const FlatScene& flat) {
    const std::size_t count = scene.materials.size();
    std::vector<bool> used(count + 1, false);
    for (const FlatTriangle& t : flat.triangles)
        used[isKnown(t, count) ? static_cast<std::size_t>(t.material) : count] = true;
    const bool scattered = scene.integrator.type == IntegratorType::Path;
    std::vector<const Material*> materials;
    for (std::size_t i = 0; i < count; ++i)
        materials.push_back(used[i] && scattered ? &scene.materials[i] : nullptr);
    if (used[count] || count == 0) materials.push_back(scattered ? &fallbackMaterial() : nullptr);
    return materials;
}

std::vector<const Spectrum*> spectraOfMaterials(const std::vector<const Material*>& materials) {
    std::vector<const Spectrum*> all;
    for (const Material* material : materials)
        if (material)
            for (const Spectrum* spectrum : spectraOf(*material)) all.push_back(spectrum);
    return all;
}

MaterialPart compileMaterials(const std::vector<const Material*>& materials, const SpectrumTable& spectra) {
    MaterialPart part;
    for (const Material* material : materials) {
        part.records.push_back(material ? recordOf(*material, spectra) : kernel::CrtMaterial{});
        if (!material) continue;
        const kernel::CrtMaterial& record = part.records.back();
        part.features |= 1u << record.type;
        if ((record.flags & CRT_MATERIAL_DISPERSIVE) != 0) part.features |= CRT_FEATURE_DISPERSION;
    }
    return part;
}

std::vector<kernel::CrtPrimitive> compilePrimitives(const FlatScene& flat, std::size_t scene_materials,
                                                    const std::vector<std::uint32_t>& light_of) {
    std::vector<kernel::CrtPrimitive> primitives(flat.triangles.size());
    std::uint32_t normals = 0;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const FlatTriangle& t = flat.triangles[i];
        primitives[i].material =
            static_cast<std::uint32_t>(isKnown(t, scene_materials) ? t.material : scene_materials);
        primitives[i].light = light_of[i];
        primitives[i].object = t.object;
        primitives[i].normals = t.smooth ? normals++ : CRT_NONE;
    }
    return primitives;
}

std::vector<kernel::CrtNormals> compileNormals(const FlatScene& flat) {
    const auto smooth = std::count_if(flat.triangles.begin(), flat.triangles.end(),
                                      [](const FlatTriangle& t) { return t.smooth; });
    std::vector<kernel::CrtNormals> normals;
    normals.reserve(static_cast<std::size_t>(smooth));
    for (const FlatTriangle& t : flat.triangles) {
        if (!t.smooth) continue;
        kernel::CrtNormals& n = normals.emplace_back();
        for (std::size_t v = 0; v < 3; ++v)
            for (std::size_t k = 0; k < 3; ++k) n.n[3 * k + v] = static_cast<float>(t.normals[v][k]);
    }
    return normals;
}

}  // namespace crt
