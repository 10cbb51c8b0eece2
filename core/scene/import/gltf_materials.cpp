// Over 450 lines: one class, with a short function for each part of a material.
#include "scene/import/gltf_materials.h"

#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_specular.h"
#include "scene/import/gltf_values.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace crt {
namespace {

using tinygltf::Value;

bool hasExtension(const tinygltf::Material& material, const char* name) {
    return material.extensions.contains(name);
}

double unitOf(double value) { return std::clamp(value, 0.0, 1.0); }

const std::array<double, 3> kWhite{1, 1, 1};

std::array<double, 3> bounded(std::array<double, 3> color) {
    for (double& c : color) c = unitOf(c);
    return color;
}

/// A colour as a scene has it: a number where it is grey.
std::string colorText(const std::array<double, 3>& c) {
    if (c[0] == c[1] && c[1] == c[2]) return yamlNumber(c[0]);
    return fmt::format("{{rgb: {}, space: linear}}", yamlList(c));
}

/// The same of light, which is no reflectance: a number would be the equal-energy spectrum.
std::string lightText(const std::array<double, 3>& c, double scale) {
    return fmt::format("{{rgb: {}, space: linear, scale: {}}}", yamlList(c), yamlNumber(scale));
}

/// glTF's material of primitives without one.
const tinygltf::Material& standardMaterial() {
    static const tinygltf::Material material = [] {
        tinygltf::Material m;
        m.pbrMetallicRoughness.baseColorFactor = {1, 1, 1, 1};
        m.pbrMetallicRoughness.metallicFactor = 1;
        m.pbrMetallicRoughness.roughnessFactor = 1;
        return m;
    }();
    return material;
}

const Value* transformOf(const tinygltf::ExtensionMap& extensions) {
    const auto found = extensions.find("KHR_texture_transform");
    return found == extensions.end() ? nullptr : &found->second;
}

}  // namespace

/// A material that is read for a use.
struct GltfMaterials::Source {
    const tinygltf::Material& material;
    const GltfMaterialUse& use;
    GltfMaterialText& text;
    std::string pointer;
    std::optional<std::size_t> set;  ///< Of the first texture that could be used; others must have the same.
};

/// Its conversion. Texts are values of the scene's keys; empty ones are left out.
struct GltfMaterials::Surface {
    std::string color;
    std::array<double, 3> color_factor{1, 1, 1};  ///< On the texture or the colours of vertices, or alone.
    double metal = 1, rough = 1;
    std::string metal_texture, rough_texture;  ///< In place of them; the roughness is the mean then.
    std::string opacity;
    std::string normal_map;
    Keys dielectric;  ///< Keys of what is not metal.
    std::string gloss_color;  ///< Tint of the gloss on what is neither metal nor clear.
    Keys layers;              ///< Keys of coat and fuzz.
    std::string clear;  ///< Share of the dielectric that is glass; empty: none.
    bool all_clear = false, absorbs = false;
    bool sheet = false;  ///< Some of it lets light through diffusely.
    std::string pane;  ///< Share of the surface that is a pane; empty: none.
    std::string pane_ior, pane_tint;

    /// A share of glass or of a pane that a texture says counts as all of it.
    double mirrors() const {
        constexpr double kGlossy = 0.5;
        const bool transmits = all_clear || pane == "1" || clear.starts_with("{") || pane.starts_with("{");
        return transmits ? 1 : rough < kGlossy ? metal : 0;
    }
};

/// The texture, where the primitive has its coordinates and crt reads its image; else it is a loss.
std::optional<GltfTexture> GltfMaterials::usable(Source& source, std::optional<GltfTexture> texture,
                                                 const char* what) {
    if (!texture) return std::nullopt;
    const std::string name = source.material.name.empty() ? "a material" : source.material.name;
    if ((source.use.uv_sets >> texture->set & 1) == 0) {
        losses_.add(fmt::format("{} of '{}': a mesh has no TEXCOORD_{}", what, name, texture->set));
        return std::nullopt;
    }
    if (source.set && *source.set != texture->set) {
        losses_.add(
            fmt::format("{} of '{}': it uses a second set of texture coordinates, and a mesh has one",
                        what, name));
        return std::nullopt;
    }
    if (!textures_.canRead(*texture)) return std::nullopt;
    source.set = texture->set;
    source.text.uv_set = texture->set;
    return texture;
}

/// A factor, or a channel of a texture times it; empty where it is 0 everywhere.
std::string GltfMaterials::weight(Source& source, const std::optional<GltfTexture>& texture, double factor,
                                  const char* channel, const char* what) {
    if (factor <= 0) return {};
    const std::optional<GltfTexture> image = usable(source, texture, what);
    if (!image) return yamlNumber(factor);
    const std::size_t number = channel[0] == 'r' ? 0 : channel[0] == 'g' ? 1 : 2;
    const TexelStatistics& texels = textures_.statistics(*image);
    if (texels.most[number] == 0) return {};
    if (texels.isConstant(number)) return yamlNumber(factor * texels.mean[number]);
    std::string more = fmt::format(", channel: {}", channel);
    if (factor != 1) more += ", factor: " + yamlNumber(factor);
    return textures_.form(*image, more);
}

void GltfMaterials::readColor(Source& source, Surface& surface) {
    const tinygltf::PbrMetallicRoughness& pbr = source.material.pbrMetallicRoughness;
    for (std::size_t k = 0; k < 3 && k < pbr.baseColorFactor.size(); ++k)
        surface.color_factor[k] = unitOf(pbr.baseColorFactor[k]);
    const auto texture = usable(source,
                                textures_.named(pbr.baseColorTexture.index, pbr.baseColorTexture.texCoord,
                                                transformOf(pbr.baseColorTexture.extensions),
                                                source.pointer + "/pbrMetallicRoughness/baseColorTexture"),
                                "the texture of the base colour");
    if (texture) {
        std::string more =
            surface.color_factor == kWhite ? "" : ", factor: " + yamlList(surface.color_factor);
        if (source.use.colors) more += ", vertex_colors: true";
        surface.color = textures_.form(*texture, more);
    } else if (source.use.colors) {
        surface.color = "{attribute: colors}";
        source.text.color_factor = surface.color_factor;
    } else {
        surface.color = colorText(surface.color_factor);
    }
}

void GltfMaterials::readMetal(Source& source, Surface& surface) {
    const tinygltf::PbrMetallicRoughness& pbr = source.material.pbrMetallicRoughness;
    surface.metal = unitOf(pbr.metallicFactor);
    surface.rough = unitOf(pbr.roughnessFactor);
    const auto texture =
        usable(source,
               textures_.named(pbr.metallicRoughnessTexture.index, pbr.metallicRoughnessTexture.texCoord,
                               transformOf(pbr.metallicRoughnessTexture.extensions),
                               source.pointer + "/pbrMetallicRoughness/metallicRoughnessTexture"),
               "the texture of metalness and roughness");
    if (!texture) return;
    const TexelStatistics& texels = textures_.statistics(*texture);
    const auto form = [&](const char* channel, double factor) {
        const std::string more = factor == 1 ? "" : ", factor: " + yamlNumber(factor);
        return textures_.form(*texture, fmt::format(", channel: {}{}", channel, more));
    };
    if (surface.metal > 0 && !texels.isConstant(2)) surface.metal_texture = form("blue", surface.metal);
    if (surface.rough > 0 && !texels.isConstant(1)) surface.rough_texture = form("green", surface.rough);
    surface.metal *= texels.mean[2];
    surface.rough *= texels.mean[1];
}

void GltfMaterials::readOpacity(Source& source, Surface& surface) {
    const tinygltf::Material& material = source.material;
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    if (material.alphaMode != "MASK" && material.alphaMode != "BLEND") return;
    double factor = pbr.baseColorFactor.size() > 3 ? unitOf(pbr.baseColorFactor[3]) : 1;
    if (source.use.alpha[0] == source.use.alpha[1]) factor *= source.use.alpha[0];
    const bool mask = material.alphaMode == "MASK";
    const auto texture = usable(source,
                                textures_.named(pbr.baseColorTexture.index, pbr.baseColorTexture.texCoord,
                                                transformOf(pbr.baseColorTexture.extensions),
                                                source.pointer + "/pbrMetallicRoughness/baseColorTexture"),
                                "the texture of the opacity");
    const double cutoff = std::max(material.alphaCutoff, 0.0);
    if (!texture || factor == 0 || !textures_.hasHoles(*texture)) {
        const double there = mask ? (factor >= cutoff ? 1 : 0) : factor;
        if (there < 1) surface.opacity = yamlNumber(there);
        return;
    }
    std::string more = ", channel: alpha";
    if (mask && cutoff > factor) {
        surface.opacity = "0";
        return;
    }
    if (mask) more += ", cutoff: " + yamlNumber(cutoff / factor);
    if (!mask && factor != 1) more += ", factor: " + yamlNumber(factor);
    surface.opacity = textures_.form(*texture, more);
}

/// True if the alpha of COLOR_0 varies. It takes the place of texture coordinates, so that there can be no
/// texture beside it.
void GltfMaterials::readVertexOpacity(Source& source, Surface& surface) {
    const tinygltf::Material& material = source.material;
    if (source.use.alpha[0] == source.use.alpha[1] ||
        (material.alphaMode != "MASK" && material.alphaMode != "BLEND"))
        return;
    if (source.set)
        return losses_.add("the alpha of vertices together with a texture: crt uses the opacity of the "
                           "texture");
    const std::vector<double>& color = material.pbrMetallicRoughness.baseColorFactor;
    const double factor = color.size() > 3 ? unitOf(color[3]) : 1,
                 cutoff = std::max(material.alphaCutoff, 0.0);
    const bool mask = material.alphaMode == "MASK";
    if (factor == 0 || (mask && cutoff > factor)) return;  // As without it: nothing is there.
    std::string form = "{attribute: opacity";
    if (mask) form += ", cutoff: " + yamlNumber(cutoff / factor);
    if (!mask && factor != 1) form += ", factor: " + yamlNumber(factor);
    surface.opacity = form + "}";
    source.text.vertex_opacity = true;
}

void GltfMaterials::readNormals(Source& source, Surface& surface) {
    const tinygltf::NormalTextureInfo& info = source.material.normalTexture;
    const auto texture = usable(source,
                                textures_.named(info.index, info.texCoord, transformOf(info.extensions),
                                                source.pointer + "/normalTexture"),
                                "the normal map");
    if (!texture) return;
    if (!textures_.hasColors(*texture)) return losses_.add("a normal map that is grey");
    if (info.scale < 0 || info.scale > 100)
        losses_.add("the scale of a normal map, which is not in 0 to 100");
    const double strength = std::clamp(info.scale, 0.0, 100.0);
    source.text.normal_map = true;
    surface.normal_map =
        textures_.form(*texture, strength == 1 ? "" : ", strength: " + yamlNumber(strength));
}

/// Index and strength of the reflection of what is not metal.
void GltfMaterials::readDielectric(Source& source, Surface& surface) {
    double ior = gltfNumber(gltfExtension(source.material, "KHR_materials_ior"), "ior", 1.5);
    if (ior < 1 || ior > 10) {
        losses_.add("an index of refraction that is not in 1 to 10: crt uses 1.5");
        ior = 1.5;
    }
    surface.pane_ior = yamlNumber(ior);
    if (ior != 1.5) surface.dielectric.emplace_back("specular_ior", yamlNumber(ior));
    const Value& specular = gltfExtension(source.material, "KHR_materials_specular");
    if (!specular.IsObject()) return;
    std::array<double, 3> color = gltfColor(specular, "specularColorFactor", kWhite);
    double factor = unitOf(gltfNumber(specular, "specularFactor", 1));
    // Grey, and what is above 1, is OpenPBR's weight: a factor straight on. Its index is 10 at most.
    const bool grey = color[0] == color[1] && color[1] == color[2];
    const double most = gltfLargest(color), straight_on = std::pow((ior - 1) / (ior + 1), 2);
    if (grey || most > 1) {
        factor *= most;
        for (double& c : color) c = grey ? 1 : c / most;
    }
    constexpr double kMost = 0.66;
    if (factor * straight_on > kMost) {
        losses_.add("specular reflections of more than two thirds of the light: crt uses two thirds");
        factor = kMost / straight_on;
    }
    const auto texture = usable(source, textures_.named(specular, "specularColorTexture", source.pointer),
                                "the texture of the colour of specular reflections");
    if (texture)
        surface.gloss_color =
            textures_.form(*texture, color == kWhite ? "" : ", factor: " + yamlList(color));
    else if (color != kWhite)
        surface.gloss_color = colorText(color);
    if (specular.Has("specularTexture")) losses_.add("a texture of the strength of specular reflections");
    if (factor != 1) surface.dielectric.emplace_back("specular_weight", yamlNumber(factor));
}

void GltfMaterials::readClear(Source& source, Surface& surface) {
    const Value& transmission = gltfExtension(source.material, "KHR_materials_transmission");
    const double factor = unitOf(gltfNumber(transmission, "transmissionFactor", 0));
    const std::string share =
        weight(source, textures_.named(transmission, "transmissionTexture", source.pointer), factor, "red",
               "the texture of the transmission");
    if (share.empty()) return;
    const Value& volume = gltfExtension(source.material, "KHR_materials_volume");
    const double thickness = gltfNumber(volume, "thicknessFactor", 0);
    if (!(thickness > 0)) {
        surface.pane = share;
        if (surface.color != "1") surface.pane_tint = surface.color;
        return;
    }
    surface.clear = share;
    surface.all_clear = share == "1";
    if (volume.Has("thicknessTexture")) losses_.add("a texture of thickness: crt uses the mesh itself as "
                                                    "the body");
    if (surface.color.starts_with("{texture")) losses_.add("a texture that tints what glass lets through");
    // Transmittance over the thickness: of the base colour once, and of the attenuation.
    const double distance = gltfNumber(volume, "attenuationDistance", 0);
    std::array<double, 3> left = surface.color.starts_with("{texture") ? kWhite : surface.color_factor;
    const std::array<double, 3> attenuation = bounded(gltfColor(volume, "attenuationColor", kWhite));
    const double depth = distance > 0 && left == kWhite ? distance : thickness;
    for (std::size_t k = 0; k < 3; ++k) {
        if (distance > 0) left[k] *= std::pow(attenuation[k], depth / distance);
        left[k] = std::clamp(left[k], 1e-4, 1.0);
    }
    surface.dielectric.emplace_back("transmission_weight", share);
    if (const double dispersion =
            gltfNumber(gltfExtension(source.material, "KHR_materials_dispersion"), "dispersion", 0);
        dispersion > 0) {
        surface.dielectric.emplace_back("transmission_dispersion_scale", yamlNumber(unitOf(dispersion)));
        if (dispersion > 1) losses_.add("a dispersion above 1: crt uses 1");
    }
    if (left == kWhite) return;
    surface.absorbs = true;
    surface.dielectric.emplace_back("transmission_color", colorText(left));
    surface.dielectric.emplace_back("transmission_depth", yamlNumber(depth));
}

void GltfMaterials::readCoat(Source& source, Surface& surface) {
    const Value& coat = gltfExtension(source.material, "KHR_materials_clearcoat");
    const double factor = unitOf(gltfNumber(coat, "clearcoatFactor", 0));
    if (factor == 0) return;
    if (!surface.clear.empty()) return losses_.add("a clear coat on glass");
    if (surface.sheet) return losses_.add("a clear coat on what transmits diffusely");
    const std::string share = weight(source, textures_.named(coat, "clearcoatTexture", source.pointer),
                                     factor, "red", "the texture of the clear coat");
    if (share.empty()) return;
    const std::string rough =
        weight(source, textures_.named(coat, "clearcoatRoughnessTexture", source.pointer),
               unitOf(gltfNumber(coat, "clearcoatRoughnessFactor", 0)), "green",
               "the texture of the clear coat's roughness");
    if (coat.Has("clearcoatNormalTexture")) losses_.add("the normal map of a clear coat");
    surface.layers.emplace_back("coat_weight", share);
    surface.layers.emplace_back("coat_roughness", rough);
    surface.layers.emplace_back("coat_ior", "1.5");
    surface.layers.emplace_back("coat_darkening", "0");
}

void GltfMaterials::readFuzz(Source& source, Surface& surface) {
    const Value& sheen = gltfExtension(source.material, "KHR_materials_sheen");
    std::array<double, 3> color = bounded(gltfColor(sheen, "sheenColorFactor", {0, 0, 0}));
    if (gltfLargest(color) > 0)
        if (const auto texture = usable(source, textures_.named(sheen, "sheenColorTexture", source.pointer),
                                        "the texture of the sheen")) {
            const TexelStatistics& texels = textures_.statistics(*texture);
            if (!texels.isConstant()) losses_.add("the texture of a sheen: crt uses its mean");
            for (std::size_t k = 0; k < 3; ++k) color[k] *= texels.linear_mean[k];
        }
    const double most = gltfLargest(color);
    if (most == 0) return;
    if (sheen.Has("sheenRoughnessTexture")) losses_.add("the texture of a sheen's roughness");
    losses_.add("sheen: crt uses the fuzz of OpenPBR, a different model");
    for (double& c : color) c /= most;
    surface.layers.emplace_back("fuzz_weight", yamlNumber(most));
    surface.layers.emplace_back("fuzz_color", colorText(color));
    surface.layers.emplace_back("fuzz_roughness",
                                yamlNumber(unitOf(gltfNumber(sheen, "sheenRoughnessFactor", 0))));
}

/// A sheet that lets light through diffusely, below the gloss.
void GltfMaterials::readSheet(Source& source, Surface& surface) {
    const Value& sheet = gltfExtension(source.material, "KHR_materials_diffuse_transmission");
    const double factor = unitOf(gltfNumber(sheet, "diffuseTransmissionFactor", 0));
    if (factor == 0) return;
    if (!surface.clear.empty()) return losses_.add("diffuse transmission of glass");
    std::string share = yamlNumber(factor);
    if (const auto texture =
            usable(source, textures_.named(sheet, "diffuseTransmissionTexture", source.pointer),
                   "the texture of the diffuse transmission");
        texture && textures_.hasHoles(*texture))
        share = textures_.form(*texture,
                               ", channel: alpha" + (factor == 1 ? "" : ", factor: " + yamlNumber(factor)));
    const std::array<double, 3> color = bounded(gltfColor(sheet, "diffuseTransmissionColorFactor", kWhite));
    const auto texture =
        usable(source, textures_.named(sheet, "diffuseTransmissionColorTexture", source.pointer),
               "the texture of the colour of diffuse transmission");
    if (gltfNumber(gltfExtension(source.material, "KHR_materials_volume"), "thicknessFactor", 0) > 0)
        losses_.add("the volume of what transmits diffusely: crt makes it a thin sheet");
    surface.sheet = true;
    surface.dielectric.emplace_back("geometry_thin_walled", "true");
    surface.dielectric.emplace_back("subsurface_weight", share);
    surface.dielectric.emplace_back(
        "subsurface_color",
        texture ? textures_.form(*texture, color == kWhite ? "" : ", factor: " + yamlList(color))
                : colorText(color));
    surface.dielectric.emplace_back("subsurface_scatter_anisotropy", "1");
}

/// Light of the object: of one colour, or an image.
void GltfMaterials::readEmission(Source& source) {
    std::array<double, 3> color{0, 0, 0};
    for (std::size_t k = 0; k < 3 && k < source.material.emissiveFactor.size(); ++k)
        color[k] = std::max(source.material.emissiveFactor[k], 0.0);
    if (gltfLargest(color) == 0) return;
    // Up to 1 says the standard, but older exporters put the strength here.
    if (!(gltfLargest(color) < 1e6)) file_.fail(source.pointer + "/emissiveFactor", "it is too large");
    const double strength = std::clamp(
        gltfNumber(gltfExtension(source.material, "KHR_materials_emissive_strength"), "emissiveStrength", 1),
        0.0, 1e15);
    const tinygltf::TextureInfo& info = source.material.emissiveTexture;
    std::string image;
    if (info.index >= 0) {
        const auto texture = usable(source,
                                    textures_.named(info.index, info.texCoord, transformOf(info.extensions),
                                                    source.pointer + "/emissiveTexture"),
                                    "the texture of the emitted light");
        if (!texture) return;
        const TexelStatistics& texels = textures_.statistics(*texture);
        if (texels.most == std::array<double, 3>{0, 0, 0}) return;
        if (texels.isConstant())
            for (std::size_t k = 0; k < 3; ++k) color[k] *= texels.linear_mean[k];
        else
            image = ", color: " + textures_.form(*texture);
    }
    const double most = gltfLargest(color);
    if (!(most * strength > 0)) return;
    for (double& c : color) c /= most;
    source.text.emission = fmt::format("{{radiance: {}{}{}}}", lightText(color, most * strength * nit_),
                                       image, source.material.doubleSided ? ", two_sided: true" : "");
}

/// A surface that is seen in its colour whatever the light: it emits that, and reflects nothing.
bool GltfMaterials::readUnlit(Source& source) {
    if (!hasExtension(source.material, "KHR_materials_unlit")) return false;
    if (source.use.colors) {
        losses_.add("an unlit material with colours of vertices: crt makes it diffuse, and lights it");
        return false;
    }
    Surface surface;
    readColor(source, surface);
    readOpacity(source, surface);
    const bool image = surface.color.starts_with("{texture");
    if (gltfLargest(surface.color_factor) > 0)
        source.text.emission = fmt::format("{{radiance: {}{}, two_sided: true}}",
                                           lightText(image ? kWhite : surface.color_factor, nit_),
                                           image ? ", color: " + surface.color : "");
    add(source.text.name, {{"type", "diffuse"}, {"reflectance", "0"}, {"opacity", surface.opacity}});
    return true;
}

void GltfMaterials::add(const std::string& name, const Keys& keys) {
    text_ += fmt::format("  {}:\n", yamlText(name));
    for (const auto& [key, value] : keys)
        if (!value.empty()) text_ += fmt::format("    {}: {}\n", key, value);
}

/// One openpbr material, or, where OpenPBR says it of metal or of glass alone, a mix of two.
void GltfMaterials::write(const std::string& name, const Surface& s) {
    const bool metal = s.metal > 0 || !s.metal_texture.empty();
    const bool dielectric = s.metal < 1 || !s.metal_texture.empty();
    const bool weighted = std::any_of(s.dielectric.begin(), s.dielectric.end(),
                                      [](const auto& key) { return key.first == "specular_weight"; });
    const bool tinted = !s.gloss_color.empty() && s.clear.empty();
    if (!s.gloss_color.empty() && !tinted) losses_.add("the colour of specular reflections of glass");
    const bool split = metal && dielectric && (weighted || tinted);
    const std::string roughness = s.rough_texture.empty() ? yamlNumber(s.rough) : s.rough_texture;
    const auto keysOf = [&](const std::string& metalness, bool with_dielectric, bool whole) {
        Keys keys{{"type", "openpbr"}, {"base_color", s.color}};
        if (metalness != "0") keys.emplace_back("base_metalness", metalness);
        keys.emplace_back("specular_roughness", roughness);
        if (with_dielectric) keys.insert(keys.end(), s.dielectric.begin(), s.dielectric.end());
        if (with_dielectric && tinted) keys.emplace_back("specular_color", s.gloss_color);
        keys.insert(keys.end(), s.layers.begin(), s.layers.end());
        keys.emplace_back("normal_map", s.normal_map);
        if (whole) keys.emplace_back("geometry_opacity", s.opacity);
        return keys;
    };
    const bool pane = !s.pane.empty();
    std::string surface = pane ? names_.take(name + " (surface)", "") : name;
    if (split) {
        const std::string below = names_.take(name + " (dielectric)", ""),
                          above = names_.take(name + " (metal)", "");
        add(below, keysOf("0", true, false));
        add(above, keysOf("1", false, false));
        add(surface, {{"type", "mix"},
                      {"materials", fmt::format("[{}, {}]", yamlText(below), yamlText(above))},
                      {"amount", s.metal_texture.empty() ? yamlNumber(s.metal) : s.metal_texture},
                      {"opacity", pane ? "" : s.opacity}});
    } else {
        const std::string metalness = s.metal_texture.empty() ? yamlNumber(s.metal) : s.metal_texture;
        add(surface, keysOf(metalness, dielectric, !pane));
    }
    if (!pane) return;
    if (s.rough > 0.1) losses_.add("the roughness of a pane");
    const std::string glass = names_.take(name + " (pane)", "");
    add(glass, {{"type", "thin_dielectric"},
                {"ior", s.pane_ior},
                {"tint", s.pane_tint},
                {"normal_map", s.normal_map}});
    add(name, {{"type", "mix"},
               {"materials", fmt::format("[{}, {}]", yamlText(surface), yamlText(glass))},
               {"amount", s.pane},
               {"opacity", s.opacity}});
}

const GltfMaterialText& GltfMaterials::of(const GltfMaterialUse& use) {
    const auto [found, fresh] = known_.try_emplace(use);
    GltfMaterialText& text = found->second;
    if (!fresh) return text;
    const tinygltf::Model& model = file_.model();
    const bool own = use.material >= 0 && static_cast<std::size_t>(use.material) < model.materials.size();
    const tinygltf::Material& said =
        own ? model.materials[static_cast<std::size_t>(use.material)] : standardMaterial();
    const std::string pointer = fmt::format("/materials/{}", use.material);
    std::optional<GltfMetalParts> metal;
    const std::optional<tinygltf::Material> converted =
        withoutSpecularGlossiness(said, textures_, pointer, losses_, metal);
    const tinygltf::Material& material = converted ? *converted : said;
    text.name = names_.take(material.name, own ? fmt::format("material {}", use.material) : "standard");
    Source source{material, use, text, pointer, {}};
    if (material.occlusionTexture.index >= 0)
        losses_.add("textures of ambient occlusion: crt computes occlusion itself");
    if (readUnlit(source)) return text;
    Surface surface;
    read(source, surface);
    if (!metal || !writeByTexel(source, surface, *metal)) write(text.name, surface);
    return text;
}

void GltfMaterials::read(Source& source, Surface& surface) {
    readColor(source, surface);
    readMetal(source, surface);
    if (hasExtension(source.material, "KHR_materials_unlit")) surface.metal = 0, surface.rough = 1;
    readOpacity(source, surface);
    readNormals(source, surface);
    readDielectric(source, surface);
    readClear(source, surface);
    readSheet(source, surface);
    readCoat(source, surface);
    readFuzz(source, surface);
    readEmission(source);
    readVertexOpacity(source, surface);
    readIridescence(source, surface);
    if (gltfNumber(gltfExtension(source.material, "KHR_materials_anisotropy"), "anisotropyStrength", 0) > 0)
        losses_.add("anisotropy");
    if (surface.absorbs && !surface.opacity.empty()) {
        losses_.add("the opacity of glass that absorbs");
        surface.opacity.clear();
    }
    source.text.mirrors = surface.mirrors();
}

void GltfMaterials::readIridescence(const Source& source, Surface& surface) {
    const Value& film = gltfExtension(source.material, "KHR_materials_iridescence");
    const double factor = unitOf(gltfNumber(film, "iridescenceFactor", 0));
    if (factor <= 0) return;
    if (!surface.all_clear || surface.metal != 0 || !surface.metal_texture.empty())
        return losses_.add("iridescence of a material other than glass");
    const double thickness = std::clamp(gltfNumber(film, "iridescenceThicknessMaximum", 400), 0.0, 20000.0);
    surface.dielectric.emplace_back("thin_film_weight", yamlNumber(factor));
    surface.dielectric.emplace_back("thin_film_thickness", yamlNumber(thickness / 1000));
    surface.dielectric.emplace_back(
        "thin_film_ior", yamlNumber(std::clamp(gltfNumber(film, "iridescenceIor", 1.3), 1.0, 10.0)));
    if (film.Has("iridescenceTexture") || film.Has("iridescenceThicknessTexture"))
        losses_.add("textures of iridescence");
}

/// The surface, a dielectric, and a metal where a texture is bright enough. False where that texture cannot
/// be used.
bool GltfMaterials::writeByTexel(Source& source, Surface& surface, const GltfMetalParts& metal) {
    const auto mask = usable(source, metal.mask, "the texture of specular colour");
    if (!mask) return false;
    Source other{metal.material, source.use, source.text, source.pointer, source.set};
    Surface above;
    readColor(other, above);
    readMetal(other, above);
    above.normal_map = surface.normal_map;
    above.layers = surface.layers;
    const std::string& name = source.text.name;
    const std::string below_name = names_.take(name + " (dielectric)", ""),
                      above_name = names_.take(name + " (metal)", "");
    const std::string opacity = std::exchange(surface.opacity, {});
    write(below_name, surface);
    write(above_name, above);
    add(name, {{"type", "mix"},
               {"materials", fmt::format("[{}, {}]", yamlText(below_name), yamlText(above_name))},
               {"amount", textures_.form(
                              *mask, fmt::format(", channel: green, cutoff: {}", yamlNumber(metal.cutoff)))},
               {"opacity", opacity}});
    return true;
}

}  // namespace crt
