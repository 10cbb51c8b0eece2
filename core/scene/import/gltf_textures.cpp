#include "scene/import/gltf_textures.h"

#include "base/error.h"
#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_values.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <vector>

namespace crt {
namespace {

namespace fs = std::filesystem;

std::array<double, 2> pairOf(const tinygltf::Value& object, const char* key,
                             const std::array<double, 2>& fallback) {
    if (!object.IsObject() || !object.Has(key)) return fallback;
    const tinygltf::Value& list = object.Get(key);
    if (!list.IsArray() || list.ArrayLen() != 2 || !list.Get(0).IsNumber() || !list.Get(1).IsNumber())
        return fallback;
    return {list.Get(0).GetNumberAsDouble(), list.Get(1).GetNumberAsDouble()};
}

/// By how often each code is there.
template <class Code>
TexelStatistics statisticsOfCodes(const Texels& texels) {
    const std::size_t channels = texels.info.channels, codes = std::size_t{1} << 8 * sizeof(Code);
    const double largest = static_cast<double>(codes - 1);
    TexelStatistics found;
    for (std::size_t k = 0; k < 3; ++k) {
        if (k >= channels) {
            found.least[k] = found.least[0], found.most[k] = found.most[0];
            found.mean[k] = found.mean[0], found.linear_mean[k] = found.linear_mean[0];
            continue;
        }
        std::vector<std::uint64_t> count(codes);
        for (std::size_t i = 0; i < texels.info.count(); ++i) {
            Code code;
            std::memcpy(&code, &texels.bytes[(i * channels + k) * sizeof code], sizeof code);
            ++count[code];
        }
        found.least[k] = 1;
        for (std::size_t code = 0; code < codes; ++code) {
            if (count[code] == 0) continue;
            const double value = static_cast<double>(code) / largest;
            const double share = static_cast<double>(count[code]) / static_cast<double>(texels.info.count());
            found.least[k] = std::min(found.least[k], value);
            found.most[k] = std::max(found.most[k], value);
            found.mean[k] += share * value;
            found.linear_mean[k] += share * srgbToLinear(value);
        }
    }
    return found;
}

TexelStatistics statisticsOfFloats(const Texels& texels) {
    const std::size_t channels = texels.info.channels;
    TexelStatistics found;
    for (std::size_t k = 0; k < 3; ++k) {
        found.least[k] = 1;
        for (std::size_t i = 0; i < texels.info.count(); ++i) {
            float number;
            std::memcpy(&number, &texels.bytes[(i * channels + std::min(k, channels - 1)) * sizeof number],
                        sizeof number);
            const double value = number > 0 ? std::min<double>(number, 1) : 0;
            found.least[k] = std::min(found.least[k], value);
            found.most[k] = std::max(found.most[k], value);
            found.mean[k] += value / static_cast<double>(texels.info.count());
        }
        found.linear_mean[k] = found.mean[k];
    }
    return found;
}

}  // namespace

std::optional<GltfTexture> GltfTextures::named(int index, int set, const tinygltf::Value* transform,
                                               const std::string& pointer) const {
    if (index < 0) return std::nullopt;
    if (static_cast<std::size_t>(index) >= file_.model().textures.size())
        file_.fail(pointer, fmt::format("there is no texture {}: the file has {}, counted from 0", index,
                                        file_.model().textures.size()));
    GltfTexture texture{.index = static_cast<std::size_t>(index)};
    if (transform != nullptr) {
        texture.offset = pairOf(*transform, "offset", texture.offset);
        texture.scale = pairOf(*transform, "scale", texture.scale);
        texture.rotation = gltfNumber(*transform, "rotation", 0);
        set = static_cast<int>(std::clamp(gltfNumber(*transform, "texCoord", set), 0.0, 99.0));
    }
    if (set < 0 || set > 7) file_.fail(pointer + "/texCoord", "it is not in 0 to 7");
    texture.set = static_cast<std::size_t>(set);
    return texture;
}

std::optional<GltfTexture> GltfTextures::named(const tinygltf::Value& extension, const char* key,
                                               const std::string& pointer) const {
    if (!extension.IsObject() || !extension.Has(key)) return std::nullopt;
    const tinygltf::Value& info = extension.Get(key);
    const tinygltf::Value* transform = nullptr;
    if (info.IsObject() && info.Has("extensions") && info.Get("extensions").IsObject() &&
        info.Get("extensions").Has("KHR_texture_transform"))
        transform = &info.Get("extensions").Get("KHR_texture_transform");
    const double index = gltfNumber(info, "index", -1), set = gltfNumber(info, "texCoord", 0);
    return named(static_cast<int>(std::clamp(index, -1.0, 2e9)),
                 static_cast<int>(std::clamp(set, -1.0, 99.0)), transform, pointer + "/" + key);
}

const GltfTextures::Known& GltfTextures::image(const GltfTexture& texture) {
    const int source = file_.model().textures[texture.index].source;
    const auto [found, fresh] = images_.try_emplace(source);
    Known& known = found->second;
    if (!fresh) return known;
    if (source < 0) {
        losses_.add("a texture without a PNG or JPEG");
        return known;
    }
    const GltfFile::Image inside = file_.image(static_cast<std::size_t>(source));
    known.source = {inside.file.empty() ? inside.name : inside.file, inside.bytes};
    try {
        known.channels = texelsInfo(known.source).channels;
    } catch (const Error& e) {
        if (e.kind() == ErrorKind::Internal) throw;
        losses_.add(e.what());
        return known;
    }
    known.text =
        inside.bytes
            ? fmt::format("texture: {}, image: {}", yamlText(file_name_), source)
            : fmt::format("texture: {}",
                          yamlText(fs::proximate(inside.file, folder_.empty() ? "." : folder_).string()));
    return known;
}

bool GltfTextures::canRead(const GltfTexture& texture) { return !image(texture).text.empty(); }
bool GltfTextures::hasColors(const GltfTexture& texture) { return image(texture).channels == 3; }

bool GltfTextures::hasHoles(const GltfTexture& texture) {
    const Texels alpha = readAlpha(image(texture).source);
    if (alpha.info.type == TexelType::Float) return alpha.info.channels > 0;
    return std::any_of(alpha.bytes.begin(), alpha.bytes.end(), [](unsigned char c) { return c != 255; });
}

double GltfTextures::meanAlpha(const GltfTexture& texture) {
    const Texels alpha = readAlpha(image(texture).source);
    if (alpha.info.channels == 0) return 1;
    switch (alpha.info.type) {
        case TexelType::Uint8: return statisticsOfCodes<std::uint8_t>(alpha).mean[0];
        case TexelType::Uint16: return statisticsOfCodes<std::uint16_t>(alpha).mean[0];
        case TexelType::Float: break;
    }
    return statisticsOfFloats(alpha).mean[0];
}

/// Blender's import and three.js turn the same way: with v up, scale, then turn, then move.
std::string GltfTextures::placement(const GltfTexture& t) {
    std::string text;
    const double s = std::sin(t.rotation), c = std::cos(t.rotation);
    const std::array<double, 2> offset{t.offset[0] + t.scale[1] * s, 1 - t.offset[1] - t.scale[1] * c};
    const auto large = [](double x) { return !(std::abs(x) <= 1e6); };
    if (large(t.scale[0]) || large(t.scale[1]) || large(t.rotation) || large(offset[0]) ||
        large(offset[1])) {
        losses_.add("a texture transform beyond 1e6");
        return text;
    }
    if (t.scale != std::array<double, 2>{1, 1}) text += ", scale: " + yamlList(t.scale);
    if (t.rotation != 0) text += ", rotation_deg: " + yamlNumber(t.rotation * 180 / std::numbers::pi);
    if (offset != std::array<double, 2>{0, 0}) text += ", offset: " + yamlList(offset);
    return text;
}

std::string GltfTextures::form(const GltfTexture& texture, const std::string& more) {
    const tinygltf::Model& model = file_.model();
    std::string text = "{" + image(texture).text + more;
    const int number = model.textures[texture.index].sampler;
    if (number >= 0 && static_cast<std::size_t>(number) < model.samplers.size()) {
        const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(number)];
        if (sampler.wrapS == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) text += ", wrap: clamp";
        if (sampler.wrapS == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) text += ", wrap: mirror";
        if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) text += ", filter: nearest";
        if (sampler.wrapS != sampler.wrapT)
            losses_.add("a texture with different repetition along v: crt repeats it as along u");
    }
    return text + placement(texture) + "}";
}

const TexelStatistics& GltfTextures::statistics(const GltfTexture& texture) {
    const int source = file_.model().textures[texture.index].source;
    const auto [found, fresh] = statistics_.try_emplace(source);
    if (!fresh) return found->second;
    const Texels texels = readTexels(image(texture).source);
    switch (texels.info.type) {
        case TexelType::Uint8: found->second = statisticsOfCodes<std::uint8_t>(texels); break;
        case TexelType::Uint16: found->second = statisticsOfCodes<std::uint16_t>(texels); break;
        case TexelType::Float: found->second = statisticsOfFloats(texels); break;
    }
    return found->second;
}

}  // namespace crt
