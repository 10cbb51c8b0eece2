#include "compile/textures.h"

#include "base/parallel.h"
#include "base/stage.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <map>

namespace crt {

void setTransform(const Texture& texture, kernel::CrtTexture& record) {
    const std::array<double, 6>& m = texture.transform;
    const bool image = texture.kind == Texture::Kind::Image;
    for (std::size_t i = 0; i < 3; ++i) {
        record.from_uv[i] = static_cast<float>(m[i]);
        record.from_uv[3 + i] = static_cast<float>(image ? (i == 2 ? 1 - m[5] : -m[3 + i]) : m[3 + i]);
    }
}

namespace {

const Texture& at(const Scene& scene, TextureIndex index) {
    return scene.textures[static_cast<std::size_t>(index)];
}

/// Does not compile where two kinds have one number.
std::uint64_t featuresOf(std::uint32_t kind) {
    switch (kind) {
        case CRT_TEXTURE_SPECTRA:
        case CRT_TEXTURE_NUMBERS:
        case CRT_TEXTURE_VERTICES:
        case CRT_TEXTURE_NORMALS: break;
#define CRT_PATTERN_FEATURE(number, NAME, Name, word, KERNELS) \
    case CRT_TEXTURE_##NAME: return CRT_FEATURE_TEXTURE | CRT_FEATURE_##KERNELS;
            CRT_PATTERN_LIST(CRT_PATTERN_FEATURE)
#undef CRT_PATTERN_FEATURE
    }
    return CRT_FEATURE_TEXTURE;
}

kernel::CrtSpan appendNumbers(const std::vector<double>& numbers, BlobWriter& blob) {
    const std::vector<float> rounded(numbers.begin(), numbers.end());
    return blob.appendFilled<std::uint16_t>(2 * rounded.size(), [&](std::span<std::uint16_t> words) {
        std::memcpy(words.data(), rounded.data(), words.size_bytes());
    });
}

}  // namespace

std::vector<TextureIndex> usedTextures(const Scene& scene, const std::vector<const Material*>& materials) {
    std::vector<bool> used(scene.textures.size());
    const auto use = [&](TextureIndex index) {
        if (index != kNoTexture) used[static_cast<std::size_t>(index)] = true;
    };
    for (const Material* material : materials)
        if (material)
            for (const TextureIndex index : material->textures()) use(index);
    if (measuresLight(scene.integrator.type))
        for (const Emission& emission : scene.emissions) use(emission.texture);
    // From the last on: a texture comes after those that it uses.
    std::vector<TextureIndex> all;
    for (std::size_t i = used.size(); i-- > 0;) {
        if (!used[i]) continue;
        all.push_back(static_cast<TextureIndex>(i));
        for (const TextureValue& value : scene.textures[i].values) use(value.texture);
        if (const auto& factor = scene.textures[i].factor) use(factor->texture);
    }
    std::reverse(all.begin(), all.end());
    return all;
}

std::uint64_t texelBytes(const Scene& scene, const std::vector<TextureIndex>& textures) {
    std::map<const TextureImage*, std::uint64_t> bytes;
    for (const TextureIndex index : textures)
        if (const auto& image = at(scene, index).image)
            bytes[image.get()] = image->words() * sizeof(std::uint16_t) + sizeof(CompiledScene::Line);
    std::uint64_t sum = 0;
    for (const auto& [image, each] : bytes) sum += each;
    return sum;
}

TexturePart compileTextures(const Scene& scene, const std::vector<TextureIndex>& textures,
                            SpectrumTable& spectra, BlobWriter& blob) {
    TexturePart part;
    part.record_of.resize(scene.textures.size());
    std::map<const TextureImage*, kernel::CrtSpan> span_of;
    const auto valueOf = [&](const TextureValue& value) {
        return value.texture != kNoTexture ? part.valueOf(value.texture) : spectra.valueOf(value.spectrum);
    };
    for (const TextureIndex index : textures) {
        const Texture& texture = at(scene, index);
        kernel::CrtTexture record{};
        record.kind = static_cast<std::uint32_t>(texture.kind);
        setTransform(texture, record);
        if (texture.kind == Texture::Kind::Image) {
            const TextureImage& image = *texture.image;
            record.kind = static_cast<std::uint32_t>(image.kind);
            record.width = image.width;
            record.height = image.height;
            record.wrap = static_cast<std::uint32_t>(texture.wrap);
            record.nearest = texture.filter == TextureFilter::Nearest;
            const auto [known, fresh] = span_of.try_emplace(&image);
            if (fresh) {
                known->second = blob.appendFilled<std::uint16_t>(image.words(), [](auto) {});
                part.images.emplace_back(&image, known->second);
                part.texel_bytes += image.words() * sizeof(std::uint16_t);
            }
            record.words = known->second;
            if (texture.factor) {
                record.first = valueOf(*texture.factor);
                part.features |= CRT_FEATURE_FACTOR;
            }
        } else if (texture.kind != Texture::Kind::VertexColors) {
            record.first = valueOf(texture.values[0]);
            record.second = valueOf(texture.values[1]);
            record.words = appendNumbers(texture.numbers, blob);
        }
        part.features |= featuresOf(record.kind);
        part.record_of[static_cast<std::size_t>(index)] = static_cast<std::uint32_t>(part.records.size());
        part.records.push_back(record);
    }
    return part;
}

void decodeTextures(const TexturePart& part, BlobWriter& blob) {
    if (part.images.empty()) return;
    Stage stage("decoding textures", static_cast<double>(part.texel_bytes));
    std::atomic<std::uint64_t> done{0};
    parallelFor(part.images.size(), 1, [&](std::size_t i, std::size_t) {
        const auto& [image, span] = part.images[i];
        image->decode(blob.items<std::uint16_t>(span));
        stage.at(static_cast<double>(done += span.count * sizeof(std::uint16_t)));
    });
}

}  // namespace crt
