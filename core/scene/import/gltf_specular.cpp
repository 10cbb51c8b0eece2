#include "scene/import/gltf_specular.h"

#include "scene/import/gltf_values.h"

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

/// How much of a metal reflects `specular` at once and scatters `diffuse`, by Khronos's converter: a
/// dielectric reflects 4 %, and the base colour of both parts is the same.
double metalnessOf(const Color& diffuse, const Color& specular) {
    constexpr double kDielectric = 0.04;
    const double s = brightness(specular), left = 1 - std::max({specular[0], specular[1], specular[2]});
    if (s < kDielectric) return 0;
    const double b = brightness(diffuse) * left / (1 - kDielectric) + s - 2 * kDielectric,
                 c = kDielectric - s;
    return std::clamp((std::sqrt(b * b - 4 * kDielectric * c) - b) / (2 * kDielectric), 0.0, 1.0);
}

/// What an extension says of a texture, as the core of glTF has it.
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

}  // namespace

std::optional<tinygltf::Material> withoutSpecularGlossiness(const tinygltf::Material& material,
                                                            GltfTextures& textures,
                                                            const std::string& pointer, Losses& losses) {
    const Value& own = gltfExtension(material, kGltfSpecularGlossiness);
    const tinygltf::PbrMetallicRoughness& other = material.pbrMetallicRoughness;
    if (!own.IsObject() || other.baseColorTexture.index >= 0 || other.metallicRoughnessTexture.index >= 0)
        return std::nullopt;
    const std::string at = pointer + "/extensions/" + kGltfSpecularGlossiness;
    Color diffuse{1, 1, 1};
    double opacity = 1;
    if (own.Has("diffuseFactor") && own.Get("diffuseFactor").IsArray()) {
        const Value& list = own.Get("diffuseFactor");
        const auto number = [&](std::size_t k) {
            return list.ArrayLen() > k && list.Get(static_cast<int>(k)).IsNumber()
                       ? std::clamp(list.Get(static_cast<int>(k)).GetNumberAsDouble(), 0.0, 1.0)
                       : 1.0;
        };
        diffuse = {number(0), number(1), number(2)};
        opacity = number(3);
    }
    Color specular = gltfColor(own, "specularFactor", {1, 1, 1});
    for (double& s : specular) s = std::min(s, 1.0);
    double glossiness = std::clamp(gltfNumber(own, "glossinessFactor", 1), 0.0, 1.0);
    const Color specular_factor = specular;
    Color seen = diffuse;
    if (const auto image = textures.named(own, "diffuseTexture", at); image && textures.canRead(*image))
        for (std::size_t k = 0; k < 3; ++k) seen[k] *= textures.statistics(*image).linear_mean[k];
    const auto image = textures.named(own, "specularGlossinessTexture", at);
    const bool textured = image && textures.canRead(*image);
    if (textured) {
        for (std::size_t k = 0; k < 3; ++k) specular[k] *= textures.statistics(*image).linear_mean[k];
        glossiness *= textures.meanAlpha(*image);
    }
    const bool metal = metalnessOf(seen, specular) >= 0.5;
    if (textured)
        losses.add(metal ? "glossiness by a texture: its mean"
                         : "specular colour and glossiness by a texture: their means");

    tinygltf::Material result = material;
    tinygltf::PbrMetallicRoughness& pbr = result.pbrMetallicRoughness;
    pbr.metallicFactor = metal ? 1 : 0;
    pbr.roughnessFactor = 1 - glossiness;
    if (metal) {
        pbr.baseColorFactor = {specular_factor[0], specular_factor[1], specular_factor[2], opacity};
        pbr.baseColorTexture = textureInfo(own, "specularGlossinessTexture");
        if (textured && material.alphaMode != "OPAQUE") {
            losses.add("the opacity of a metal by specular colour");  // That alpha is glossiness.
            result.alphaMode = "OPAQUE";
        }
        return result;
    }
    const double left = 1 - std::max({specular[0], specular[1], specular[2]});
    pbr.baseColorFactor = {diffuse[0] * left, diffuse[1] * left, diffuse[2] * left, opacity};
    pbr.baseColorTexture = textureInfo(own, "diffuseTexture");
    // The index by what is reflected straight on; colour has no place in it.
    const double straight = (specular[0] + specular[1] + specular[2]) / 3;
    if (specular[0] != specular[1] || specular[1] != specular[2])
        losses.add("the colour of specular reflections of a dielectric");
    const double root = std::sqrt(std::min(straight, 0.6));
    Value::Object index{{"ior", Value((1 + root) / (1 - root))}};
    result.extensions["KHR_materials_ior"] = Value(std::move(index));
    return result;
}

}  // namespace crt
