/// Materials of a glTF file → those of a scene, as text.
#pragma once

#include "scene/import/gltf_textures.h"

#include <array>
#include <compare>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// The material of a primitive.
struct GltfMaterialUse {
    int material = -1;     ///< −1: glTF's own.
    bool colors = false;   ///< COLOR_0.
    unsigned uv_sets = 0;  ///< Bit n: TEXCOORD_n.
    /// The least and the most of COLOR_0, where the material has opacity.
    std::array<double, 2> alpha{1, 1};

    auto operator<=>(const GltfMaterialUse&) const = default;
};

struct GltfMetalParts;

/// Requirements of such a material on its object.
struct GltfMaterialText {
    std::string name;
    std::size_t uv_set = 0;
    std::array<double, 3> color_factor{1, 1, 1};
    std::string emission;         ///< Of the object; empty: none.
    bool vertex_opacity = false;  ///< It uses opacities instead of texture coordinates.
    bool normal_map = false;
    double mirrors = 0;  ///< Share of the surface that sends light on in single directions alone.
};

class GltfMaterials {
public:
    /// `nit` is the radiance, over that of an rgb of 1, that a luminance of 1 cd/m² has in this scene. All
    /// references live as long as this.
    GltfMaterials(GltfFile& file, GltfTextures& textures, double nit, Losses& losses)
        : file_(file), textures_(textures), nit_(nit), losses_(losses) {}

    /// The material, whose text is made when it is first asked for.
    const GltfMaterialText& of(const GltfMaterialUse& use);
    /// All that were asked for: the lines below `materials:`.
    const std::string& text() const { return text_; }

private:
    using Keys = std::vector<std::pair<std::string, std::string>>;
    struct Source;
    struct Surface;

    std::optional<GltfTexture> usable(Source& source, std::optional<GltfTexture> texture, const char* what);
    std::string weight(Source& source, const std::optional<GltfTexture>& texture, double factor,
                       const char* channel, const char* what);
    void readColor(Source& source, Surface& surface);
    void readMetal(Source& source, Surface& surface);
    void readOpacity(Source& source, Surface& surface);
    void readVertexOpacity(Source& source, Surface& surface);
    void readNormals(Source& source, Surface& surface);
    void readDielectric(Source& source, Surface& surface);
    void readClear(Source& source, Surface& surface);
    void readSheet(Source& source, Surface& surface);
    void readCoat(Source& source, Surface& surface);
    void readFuzz(Source& source, Surface& surface);
    void readEmission(Source& source);
    bool readUnlit(Source& source);
    void read(Source& source, Surface& surface);
    void readIridescence(const Source& source, Surface& surface);
    void add(const std::string& name, const Keys& keys);
    void write(const std::string& name, const Surface& surface);
    bool writeByTexel(Source& source, Surface& surface, const GltfMetalParts& metal);

    GltfFile& file_;
    GltfTextures& textures_;
    double nit_;
    Losses& losses_;
    UniqueNames names_;
    std::map<GltfMaterialUse, GltfMaterialText> known_;
    std::string text_;
};

}  // namespace crt
