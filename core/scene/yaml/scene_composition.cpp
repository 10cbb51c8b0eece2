/// The part of MaterialReader that reads materials made of others: names looked up, since they may come
/// later in the file, and what cannot be refused.
#include "scene/yaml/scene_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace crt {
/// Of the material that is being read, which gets the next number.
void MaterialReader::readParts(const SectionReader& material) {
    std::array<PartName, 2>& parts = parts_[static_cast<std::int32_t>(scene_.materials.size())];
    if (variantWord(material.schema()) == "two_sided") {
        constexpr const char* kSides[] = {"front", "back"};
        for (std::size_t i = 0; i < 2; ++i) {
            material.read(kSides[i], parts[i].name);
            parts[i].place = material.place(kSides[i]);
        }
        return;
    }
    const YamlNode* const list = material.list("materials");
    if (list == nullptr) return;
    if (list->items.size() != 2) {
        material.error("materials",
                       fmt::format("a mix needs two materials, not {}", list->items.size()),
                       list->items.size() > 2 ? "mix two of them first, then that mix with the next" : "");
        return;
    }
    for (std::size_t i = 0; i < 2; ++i) {
        const YamlNode& item = *list->items[i];
        parts[i].place = item.place;
        readText(out_, item, item.place, fmt::format("material {} of {}", i + 1, material.subject()),
                 parts[i].name);
    }
}

void MaterialReader::resolveParts() {
    const std::size_t errors_before = out_.count();
    for (const auto& [index, names] : parts_)
        for (std::size_t i = 0; i < 2; ++i)
            if (!names[i].name.empty())
                scene_.materials[static_cast<std::size_t>(index)].parts[i] =
                    find(names[i].name, names[i].place, false).value_or(-1);
    if (out_.count() != errors_before) return;
    for (const auto& [index, names] : parts_) {
        checkParts({index});
        if (out_.count() != errors_before) return;  // a cycle would be told of each of its materials
    }
    for (const auto& [index, names] : parts_) checkInsides(index, names[0].place);
}

/// The glass that a material is or is mixed of, all of it.
std::vector<const Material*> MaterialReader::glassOf(const Material& material) const {
    if (material.type == MaterialType::Dielectric || material.type == MaterialType::RoughDielectric)
        return {&material};
    std::vector<const Material*> all;
    if (material.isComposed())
        for (const std::int32_t part : material.parts) {
            if (part < 0) continue;  // Its name is missing or wrong; that error is reported where it stands.
            for (const Material* glass : glassOf(scene_.materials[static_cast<std::size_t>(part)]))
                all.push_back(glass);
        }
    return all;
}

/// Light enters a body by one part of a mix and may leave it by another: both must mean the same inside, or
/// the n² that one gives is not the n² that the other takes.
void MaterialReader::checkInsides(std::int32_t whole, const YamlPlace& place) const {
    const Material& material = scene_.materials[static_cast<std::size_t>(whole)];
    const std::vector<const Material*> all = glassOf(material);
    const auto absorption = [](const Material& glass) {
        return glass.absorption.value_or(constantSpectrum(0));
    };
    for (const Material* glass : all)
        if (!(glass->eta == all[0]->eta) || !(absorption(*glass) == absorption(*all[0]))) {
            out_.error(place,
                       fmt::format("material '{}' is a mix of glass '{}' and glass '{}', whose 'ior' or "
                                   "'absorption' differ: the inside of a surface can have only one of each",
                                   material.name, all[0]->name, glass->name),
                       "give both the same 'ior' and the same 'absorption'");
            return;
        }
}

/// Also of the unnamed parts of an openpbr material.
bool MaterialReader::transmits(const Material& part) const {
    const auto index = static_cast<std::int32_t>(&part - scene_.materials.data());
    if (part.type != MaterialType::Mix || parts_.contains(index)) return part.transmits();
    return std::any_of(part.parts.begin(), part.parts.end(), [&](std::int32_t i) {
        return i >= 0 && transmits(scene_.materials[static_cast<std::size_t>(i)]);
    });
}

/// `way`: from a material to one that it is made of, by way of others.
void MaterialReader::checkParts(const std::vector<std::int32_t>& way) {
    const auto found = parts_.find(way.back());
    if (found == parts_.end()) return;
    const auto at = [&](std::int32_t index) -> const Material& {
        return scene_.materials[static_cast<std::size_t>(index)];
    };
    const Material& whole = at(way.back());
    for (std::size_t i = 0; i < 2; ++i) {
        const std::int32_t part = whole.parts[i];
        const YamlPlace& place = found->second[i].place;
        if (part < 0) continue;
        std::vector<std::int32_t> further = way;
        further.push_back(part);
        if (const auto again = std::find(way.begin(), way.end(), part); again != way.end()) {
            std::vector<std::string> names;
            for (auto step = further.begin() + (again - way.begin()); step != further.end(); ++step)
                names.push_back("'" + at(*step).name + "'");
            out_.error(place, fmt::format("material '{}' is made of itself: {}", at(part).name,
                                          fmt::join(names, " of ")));
            return;
        }
        if (further.size() > static_cast<std::size_t>(kDeepestComposition) + 1) {
            out_.error(place, fmt::format("material '{}' nests materials more than {} deep",
                                          at(way.front()).name, kDeepestComposition));
            return;
        }
        if (!at(part).isOpaque())
            out_.error(place,
                       fmt::format("material '{}' is part of another material and cannot set 'opacity'",
                                   at(part).name),
                       fmt::format("give the opacity to '{}'", at(way.front()).name));
        if (at(part).emission >= 0)
            out_.error(place,
                       fmt::format("material '{}' is part of another material and cannot emit light",
                                   at(part).name),
                       "leave its 'emission_luminance' out, and give the object 'emission'");
        const bool one_side = std::any_of(way.begin(), way.end(), [&](std::int32_t index) {
            return at(index).type == MaterialType::TwoSided;
        });
        if (one_side && transmits(at(part)))
            out_.error(place, fmt::format("material '{}' lets light through, so it cannot be a side of a "
                                          "two_sided material",
                                          at(part).name));
        checkParts(further);
    }
}

}  // namespace crt
