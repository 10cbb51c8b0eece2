/// Materials of KHR_materials_pbrSpecularGlossiness → those of metalness and roughness.
#pragma once

#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_textures.h"

#include <optional>
#include <string>

namespace crt {

inline constexpr const char* kGltfSpecularGlossiness = "KHR_materials_pbrSpecularGlossiness";

/// The metal of a material that is one in parts.
struct GltfMetalParts {
    tinygltf::Material material;
    std::optional<GltfTexture> mask;  ///< If its green is `cutoff` or more, the material is this metal.
    double cutoff = 0;
};

/// The material, said by metalness and roughness: a metal of the specular colour, or a dielectric of the
/// diffuse one, whichever its mean is nearer to; both by their textures. Where a texture of specular colour
/// has both, the dielectric, and *metal for the rest. Nothing where the material has not the extension, or
/// says itself by metalness and roughness with a texture, too.
std::optional<tinygltf::Material> withoutSpecularGlossiness(const tinygltf::Material& material,
                                                            GltfTextures& textures,
                                                            const std::string& pointer, Losses& losses,
                                                            std::optional<GltfMetalParts>& metal);

}  // namespace crt
