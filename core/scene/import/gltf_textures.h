/// Textures of a glTF file → those of a scene, as text.
#pragma once

#include "image/texels.h"
#include "scene/gltf/gltf_file.h"
#include "scene/import/scene_text.h"

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

namespace tinygltf {
class Value;
}

namespace crt {

/// A texture that a material names: an image, how it is repeated, and where it lies.
struct GltfTexture {
    std::size_t index = 0;  ///< Into the file's textures.
    std::size_t set = 0;    ///< n of TEXCOORD_n.
    std::array<double, 2> offset{0, 0}, scale{1, 1};
    double rotation = 0;  ///< Radians, as KHR_texture_transform has it.
};

/// Range of the texels of an image, from 0 to 1 by channel.
struct TexelStatistics {
    std::array<double, 3> least{}, most{}, mean{};
    std::array<double, 3> linear_mean{};  ///< Of sRGB codes, decoded.

    bool isConstant(std::size_t channel) const { return least[channel] == most[channel]; }
    bool isConstant() const { return isConstant(0) && isConstant(1) && isConstant(2); }
};

class GltfTextures {
public:
    /// `file_name` is what the scene calls the file, `folder` where the scene is. All references live as
    /// long as this.
    GltfTextures(GltfFile& file, std::string file_name, std::string folder, Losses& losses)
        : file_(file), file_name_(std::move(file_name)), folder_(std::move(folder)), losses_(losses) {}

    /// A texture by number, set and extensions; nothing for −1. Throws where there is no such texture.
    std::optional<GltfTexture> named(int index, int set, const tinygltf::Value* transform,
                                     const std::string& pointer) const;
    /// The same of a member of an extension.
    std::optional<GltfTexture> named(const tinygltf::Value& extension, const char* key,
                                     const std::string& pointer) const;

    /// True if crt can read its image; otherwise it is a loss.
    bool canRead(const GltfTexture& texture);
    /// True if its image has colours, as normal maps must.
    bool hasColors(const GltfTexture& texture);
    /// True if some of its image is transparent. Reads the pixels.
    bool hasHoles(const GltfTexture& texture);
    /// "{texture: a.glb, image: 2}" of one that can be read; `more` are further keys: ", channel: blue".
    std::string form(const GltfTexture& texture, const std::string& more = {});
    const TexelStatistics& statistics(const GltfTexture& texture);
    /// 1 where it has none. Reads the pixels.
    double meanAlpha(const GltfTexture& texture);

private:
    struct Known {
        std::string text;  ///< Empty: it cannot be read.
        ImageSource source;
        std::size_t channels = 0;
    };
    const Known& image(const GltfTexture& texture);
    std::string placement(const GltfTexture& texture);

    GltfFile& file_;
    std::string file_name_, folder_;
    Losses& losses_;
    std::map<int, Known> images_;
    std::map<int, TexelStatistics> statistics_;
};

}  // namespace crt
