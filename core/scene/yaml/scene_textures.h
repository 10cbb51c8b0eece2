/// Values of a scene that depend on the place: images, patterns, colours of vertices.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/textures/texture_files.h"
#include "scene/yaml/scene_spectra.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>

namespace crt {

class TextureReader {
public:
    /// All references live as long as the reader.
    TextureReader(Diagnostics& out, SceneFiles& files, SpectrumReader& spectra, GltfFiles& gltf,
                  Scene& scene);

    /// True if the value under `key` is written as a texture.
    static bool isTexture(const SectionReader& section, std::string_view key);

    /// The texture under `key`, put into the scene. Nothing if it is wrong, which is reported.
    std::optional<TextureIndex> read(const SectionReader& section, std::string_view key, TexelKind kind);

    /// The image of a `normal_map`, put into the scene. kNoTexture if it is wrong, which is reported.
    TextureIndex readNormalMap(const SectionReader& form);

    /// An image of a material file. Throws crt::Error(Scene) where it cannot be read.
    TextureIndex addImage(const std::string& path, const TexelUse& use,
                          const std::array<double, 6>& transform, TextureWrap wrap,
                          const SourcePlace& place);

private:
    std::optional<TextureIndex> readForm(const YamlNode& node, const YamlPlace& place,
                                         const std::string& what, const KeySchema& row, TexelKind kind);
    std::optional<Texture> readImage(const SectionReader& form, TexelKind kind);
    std::optional<Texture> readAttribute(const SectionReader& form, const std::string& what,
                                         TexelKind kind) const;
    static Texture opacityOfVertices(const SectionReader& form);
    std::shared_ptr<const TextureImage> openImage(const SectionReader& form, const TexelUse& use);
    void readFactor(const SectionReader& form, TexelUse& use) const;
    std::optional<Texture> readPattern(const SectionReader& form, const KeySchema& row, TexelKind kind);
    bool readPart(const YamlNode& node, const std::string& what, const KeySchema& row, TexelKind kind,
                  TextureValue& value);
    void readTransform(const SectionReader& form, Texture& texture);
    void requireRoom(const TextureImage& image, const ImageSource& source);
    TextureIndex add(Texture texture);

    Diagnostics& out_;
    SceneFiles& files_;
    SpectrumReader& spectra_;
    GltfFiles& gltf_;
    Scene& scene_;
    TextureFiles images_;
    std::map<std::pair<const YamlNode*, TexelKind>, std::optional<TextureIndex>>
        written_;  ///< By node: what an alias repeats is read once.
    std::map<const TextureImage*, std::uint64_t> bytes_of_;
    std::uint64_t bytes_ = 0, largest_decoding_ = 0, file_bytes_ = 0;
};

}  // namespace crt
