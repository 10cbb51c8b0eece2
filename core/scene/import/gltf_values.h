/// Values in extensions of a glTF file, which may be missing or of a wrong type.
#pragma once

#include "scene/gltf/gltf_model.h"

#include <array>

namespace crt {

/// An extension's map; one without keys where the material has it not.
const tinygltf::Value& gltfExtension(const tinygltf::Material& material, const char* name);

double gltfNumber(const tinygltf::Value& object, const char* key, double fallback);

/// Linear, and not below 0.
std::array<double, 3> gltfColor(const tinygltf::Value& object, const char* key,
                                const std::array<double, 3>& fallback);

double gltfLargest(const std::array<double, 3>& color);

}  // namespace crt
