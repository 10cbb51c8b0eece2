#include "scene/import/gltf_values.h"

#include <algorithm>
#include <cstddef>

namespace crt {

using tinygltf::Value;

const Value& gltfExtension(const tinygltf::Material& material, const char* name) {
    static const Value nothing;
    const auto found = material.extensions.find(name);
    return found == material.extensions.end() ? nothing : found->second;
}

double gltfNumber(const Value& object, const char* key, double fallback) {
    return object.IsObject() && object.Has(key) && object.Get(key).IsNumber()
               ? object.Get(key).GetNumberAsDouble()
               : fallback;
}

std::array<double, 3> gltfColor(const Value& object, const char* key,
                                const std::array<double, 3>& fallback) {
    if (!object.IsObject() || !object.Has(key)) return fallback;
    const Value& list = object.Get(key);
    if (!list.IsArray() || list.ArrayLen() != 3) return fallback;
    std::array<double, 3> color;
    for (std::size_t k = 0; k < 3; ++k) {
        if (!list.Get(k).IsNumber()) return fallback;
        color[k] = std::max(list.Get(k).GetNumberAsDouble(), 0.0);
    }
    return color;
}

double gltfLargest(const std::array<double, 3>& color) { return std::max({color[0], color[1], color[2]}); }

}  // namespace crt
