/// Values that depend on the place, as records and texels of the blob.
#pragma once

#include "compile/blob_writer.h"
#include "compile/spectrum_table.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace crt {

/// The textures of the scene that the materials and what emits name, and those of their patterns and
/// factors, in the scene's order. compileTextures() makes a record of each, in this order.
std::vector<TextureIndex> usedTextures(const Scene& scene, const std::vector<const Material*>& materials);

/// That their images take in the blob.
std::uint64_t texelBytes(const Scene& scene, const std::vector<TextureIndex>& textures);

struct TexturePart {
    std::vector<kernel::CrtTexture> records;
    std::vector<std::uint32_t> record_of;  ///< By the scene's number.
    std::uint64_t features = 0;            ///< That kernels need for them.
    std::vector<std::pair<const TextureImage*, kernel::CrtSpan>> images;  ///< Each once.
    std::uint64_t texel_bytes = 0;

    kernel::CrtValue valueOf(TextureIndex texture) const {
        return CRT_VALUE_TEXTURE | record_of[static_cast<std::size_t>(texture)];
    }
};
/// (s, t) of the kernel, t down from the upper edge, from (u, v), v up.
void setTransform(const Texture& texture, kernel::CrtTexture& record);

/// Puts the numbers of patterns into the blob, and makes room there for the texels, each image once.
TexturePart compileTextures(const Scene& scene, const std::vector<TextureIndex>& textures,
                            SpectrumTable& spectra, BlobWriter& blob);

/// Fills the texels in, by threads. Throws crt::Error(Scene) for files that are damaged.
void decodeTextures(const TexturePart& part, BlobWriter& blob);

}  // namespace crt
