/// The variants of a glTF file's materials (KHR_materials_variants).
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/import/scene_text.h"

#include <optional>
#include <string>
#include <vector>

namespace tinygltf {
struct Primitive;
}

namespace crt {

class GltfVariants {
public:
    /// `wanted`: the name of one; empty: the default materials, and other variants are a loss. Throws
    /// crt::Error(Usage), with the names that there are, for one that the file lacks.
    GltfVariants(const GltfFile& file, const std::string& wanted, Losses& losses);

    /// The number of a primitive's material in the variant; −1: none.
    int materialOf(const tinygltf::Primitive& primitive) const;

private:
    int materials_ = 0;                  ///< The number of the file's materials.
    std::optional<std::size_t> chosen_;  ///< Number of the variant.
};

}  // namespace crt
