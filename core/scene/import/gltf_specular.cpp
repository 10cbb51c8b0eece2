#include "scene/import/gltf_specular.h"

#include "scene/import/gltf_values.h"
#include "spectra/spectra.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace crt {
namespace {

using tinygltf::Value;

using Color = std::array<double, 3>;

/// By which Khronos's converter tells metals: the root of a weighted sum of squares.
double brightness(const Color& c) {
    return std::sqrt(0.299 * c[0] * c[0] + 0.587 * c[1] * c[1] + 0.114 * c[2] * c[2]);
}

/// The share of metal with the reflectance `specular` and the diffuse colour `diffuse`, by Khronos's
/// converter: a dielectric reflects 4 %, and the base colour of both parts is the same.
double metalnessOf(const Color& diffuse, const Color& specular) {
    constexpr double kDielectric = 0.04;
    const double s = brightness(specular), left = 1 - gltfLargest(specular);
    if (s < kDielectric) return 0;
    const double b = brightness(diffuse) * left / (1 - kDielectric) + s - 2 * kDielectric,
                 c = kDielectric - s;
    return std::clamp((std::sqrt(b * b - 4 * kDielectric * c) - b) / (2 * kDielectric), 0.0, 1.0);
}

/// A reference to a texture in an extension, in the form of the core of glTF.
tinygltf::TextureInfo textureInfo(const Value& extension, const char* key) {
    tinygltf::TextureInfo info;
    info.texCoord = 0;
    if (!extension.IsObject() || !extension.Has(key)) return info;
    const Value& own = extension.Get(key);
    info.index = static_cast<int>(std::clamp(gltfNumber(own, "index", -1), -1.0, 2e9));
    info.texCoord = static_cast<int>(std::clamp(gltfNumber(own, "texCoord", 0), -1.0, 99.0));
    if (own.IsObject() && own.Has("extensions") && own.Get("extensions").IsObject())
        info.extensions = own.Get("extensions").Get<Value::Object>();
    return info;
}

/// The values of the extension, with the means of its textures.
struct Said {
    const Value& own;
    Color diffuse{1, 1, 1}, specular{1, 1, 1};  ///< Factors.
    double opacity = 1, glossiness = 1;
    std::optional<GltfTexture> diffuse_image{}, specular_image{};  ///< Those that can be read.
    Color mean_diffuse{}, mean_specular{};
    double most_diffuse = 0;  ///< Of the brightest texel and channel.
};

std::optional<GltfTexture> readable(GltfTextures& textures, std::optional<GltfTexture> texture) {
    return texture && textures.canRead(*texture) ? texture : std::nullopt;
}

Said saidIn(const Value& own, GltfTextures& textures, const std::string& at) {
    Said said{.own = own};
    if (own.Has("diffuseFactor") && own.Get("diffuseFactor").IsArray()) {
        const Value& list = own.Get("diffuseFactor");
        const auto number = [&](std::size_t k) {
            return list.ArrayLen() > k && list.Get(static_cast<int>(k)).IsNumber()
                       ? std::clamp(list.Get(static_cast<int>(k)).GetNumberAsDouble(), 0.0, 1.0)
                       : 1.0;
        };
        said.diffuse = {number(0), number(1), number(2)};
        said.opacity = number(3);
    }
    said.specular = gltfColor(own, "specularFactor", {1, 1, 1});
    for (double& s : said.specular) s = std::min(s, 1.0);
    said.glossiness = std::clamp(gltfNumber(own, "glossinessFactor", 1), 0.0, 1.0);
    said.diffuse_image = readable(textures, textures.named(own, "diffuseTexture", at));
    said.specular_image = readable(textures, textures.named(own, "specularGlossinessTexture", at));
    said.mean_diffuse = said.diffuse;
    said.mean_specular = said.specular;
    Color most = said.diffuse;
    for (std::size_t k = 0; k < 3; ++k) {
        if (said.diffuse_image) {
            const TexelStatistics& texels = textures.statistics(*said.diffuse_image);
            said.mean_diffuse[k] *= texels.linear_mean[k];
            most[k] *= srgbToLinear(texels.most[k]);
        }
        if (said.specular_image)
            said.mean_specular[k] *= textures.statistics(*said.specular_image).linear_mean[k];
    }
    said.most_diffuse = gltfLargest(most);
    if (said.specular_image) said.glossiness *= textures.meanAlpha(*said.specular_image);
    return said;
}

tinygltf::Material metalOf(const tinygltf::Material& material, const Said& said) {
    tinygltf::Material result = material;
    tinygltf::PbrMetallicRoughness& pbr = result.pbrMetallicRoughness;
    pbr.metallicFactor = 1;
    pbr.roughnessFactor = 1 - said.glossiness;
    pbr.baseColorFactor = {said.specular[0], said.specular[1], said.specular[2], said.opacity};
    pbr.baseColorTexture = textureInfo(said.own, "specularGlossinessTexture");
    return result;
}

/// `straight`: the share that it reflects straight on.
tinygltf::Material dielectricOf(const tinygltf::Material& material, const Said& said, double straight,
                                double left) {
    tinygltf::Material result = material;
    tinygltf::PbrMetallicRoughness& pbr = result.pbrMetallicRoughness;
    pbr.metallicFactor = 0;
    pbr.roughnessFactor = 1 - said.glossiness;
    pbr.baseColorFactor = {said.diffuse[0] * left, said.diffuse[1] * left, said.diffuse[2] * left,
                           said.opacity};
    pbr.baseColorTexture = textureInfo(said.own, "diffuseTexture");
    const double root = std::sqrt(std::min(straight, 0.6));
    Value::Object index{{"ior", Value((1 + root) / (1 - root))}};
    result.extensions["KHR_materials_ior"] = Value(std::move(index));
    return result;
}

/// The code of green from which on texels are of a metal, where some are and some are not. Metals reflect
/// 40 % and more, everything else below 17 % (diamond).
std::optional<double> cutoffOf(const Said& said, GltfTextures& textures) {
    constexpr std::size_t kGreen = 1;
    constexpr double kLeastOfMetals = 0.2;
    if (!said.specular_image || !(said.specular[kGreen] > kLeastOfMetals)) return std::nullopt;
    const double cutoff = linearToSrgb(kLeastOfMetals / said.specular[kGreen]);
    const TexelStatistics& texels = textures.statistics(*said.specular_image);
    if (!(texels.least[kGreen] < cutoff && cutoff <= texels.most[kGreen])) return std::nullopt;
    return cutoff;
}

}  // namespace

std::optional<tinygltf::Material> withoutSpecularGlossiness(const tinygltf::Material& material,
                                                            GltfTextures& textures,
                                                            const std::string& pointer, Losses& losses,
                                                            std::optional<GltfMetalParts>& metal) {
    const Value& own = gltfExtension(material, kGltfSpecularGlossiness);
    const tinygltf::PbrMetallicRoughness& other = material.pbrMetallicRoughness;
    if (!own.IsObject() || other.baseColorTexture.index >= 0 || other.metallicRoughnessTexture.index >= 0)
        return std::nullopt;
    const Said said = saidIn(own, textures, pointer + "/extensions/" + kGltfSpecularGlossiness);
    const Color& specular = said.mean_specular;
    const double left = 1 - gltfLargest(specular);
    // Visible losses of a metal.
    constexpr double kNoticeable = 0.02;
    const bool shows_diffuse = said.most_diffuse * left > kNoticeable;
    const std::optional<double> cutoff = cutoffOf(said, textures);
    if (cutoff && shows_diffuse) {
        constexpr double kUsual = 0.04;
        losses.add(
            "specular colour and glossiness by a texture: crt uses metal where it is bright, elsewhere a "
            "reflection of 4 %, and the mean glossiness");
        metal = GltfMetalParts{metalOf(material, said), said.specular_image, *cutoff};
        return dielectricOf(material, said, kUsual, 1 - kUsual);
    }
    const bool is_metal = metalnessOf(said.mean_diffuse, specular) >= 0.5;
    if (is_metal && !(said.diffuse_image && shows_diffuse)) {
        tinygltf::Material result = metalOf(material, said);
        if (!said.specular_image) return result;
        losses.add("glossiness by a texture: crt uses its mean");
        if (material.alphaMode != "OPAQUE") {
            losses.add("the opacity of a metal by specular colour");  // That alpha is glossiness.
            result.alphaMode = "OPAQUE";
        }
        return result;
    }
    if (is_metal) losses.add("a metal with a texture of diffuse colour: crt makes it a dielectric");
    if (said.specular_image) losses.add("specular colour and glossiness by a texture: crt uses their means");
    // The index by what is reflected straight on; colour has no place in it.
    if (specular[0] != specular[1] || specular[1] != specular[2])
        losses.add("the colour of specular reflections of a dielectric");
    return dielectricOf(material, said, (specular[0] + specular[1] + specular[2]) / 3, left);
}

}  // namespace crt
