#include "scene/import/gltf_variants.h"

#include "base/error.h"
#include "base/words.h"
#include "scene/gltf/gltf_model.h"
#include "scene/import/gltf_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace crt {
namespace {

using tinygltf::Value;

constexpr const char* kVariants = "KHR_materials_variants";

std::vector<std::string> namesOf(const tinygltf::Model& model) {
    std::vector<std::string> names;
    const auto found = model.extensions.find(kVariants);
    if (found == model.extensions.end() || !found->second.IsObject() || !found->second.Has("variants"))
        return names;
    const Value& list = found->second.Get("variants");
    for (std::size_t i = 0; list.IsArray() && i < list.ArrayLen(); ++i) {
        const Value& variant = list.Get(i);
        const bool named = variant.IsObject() && variant.Has("name") && variant.Get("name").IsString();
        names.push_back(named ? variant.Get("name").Get<std::string>() : fmt::format("variant {}", i));
    }
    return names;
}

/// "'beach', 'midnight'", not too many of them.
std::string listed(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 12;
    std::vector<std::string> quoted;
    for (const std::string& name : names)
        if (quoted.size() < kMost) quoted.push_back(fmt::format("'{}'", name.substr(0, 60)));
    return fmt::format("{}{}", fmt::join(quoted, ", "), names.size() > kMost ? " and more" : "");
}

}  // namespace

GltfVariants::GltfVariants(const GltfFile& file, const std::string& wanted, Losses& losses)
    : materials_(static_cast<int>(file.model().materials.size())) {
    const std::vector<std::string> names = namesOf(file.model());
    if (wanted.empty()) {
        if (!names.empty())
            losses.add(
                fmt::format("variants of materials: the scene has the default materials; "
                            "`crt import --variant NAME` picks one of {}",
                            listed(names)));
        return;
    }
    const auto found = std::find(names.begin(), names.end(), wanted);
    if (found == names.end()) {
        const std::string close = didYouMean(wanted, names);
        throw Error(ErrorKind::Usage,
                    names.empty() ? fmt::format("'{}' has no variants of materials", file.path())
                                  : fmt::format("'{}' has no variant '{}', but {}{}{}", file.path(), wanted,
                                                listed(names), close.empty() ? "" : "; ", close),
                    {file.path()});
    }
    chosen_ = static_cast<std::size_t>(found - names.begin());
}

int GltfVariants::materialOf(const tinygltf::Primitive& primitive) const {
    const auto found = primitive.extensions.find(kVariants);
    if (!chosen_ || found == primitive.extensions.end() || !found->second.IsObject() ||
        !found->second.Has("mappings"))
        return primitive.material;
    const Value& mappings = found->second.Get("mappings");
    for (std::size_t i = 0; mappings.IsArray() && i < mappings.ArrayLen(); ++i) {
        const Value& mapping = mappings.Get(i);
        if (!mapping.IsObject() || !mapping.Has("variants") || !mapping.Get("variants").IsArray()) continue;
        const Value& variants = mapping.Get("variants");
        for (std::size_t k = 0; k < variants.ArrayLen(); ++k)
            if (variants.Get(k).IsNumber() &&
                variants.Get(k).GetNumberAsDouble() == static_cast<double>(*chosen_)) {
                const double material = gltfNumber(mapping, "material", -1);
                return material >= 0 && material < materials_ ? static_cast<int>(material) : -1;
            }
    }
    return primitive.material;
}

}  // namespace crt
