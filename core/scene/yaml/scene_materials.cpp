#include "scene/yaml/scene_materials.h"

#include "base/log.h"
#include "scene/light_units.h"
#include "scene/scene_limits.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string_view>
#include <tuple>

namespace crt {

void MaterialReader::read(const YamlNode& map) {
    for (const YamlEntry& entry : map.entries) readMaterial(entry);
    resolveParts();
}

void MaterialReader::readMaterial(const YamlEntry& entry) {
    NamedMaterial& named = materials_[entry.key];
    named.place = entry.key_place;
    names_.push_back(entry.key);
    if (entry.key == "from_mtl" || entry.key.empty() || looksLikeNumber(entry.key)) {
        out_.error(entry.key_place,
                   fmt::format("'{}' cannot be the name of a material: the word has another meaning there",
                               entry.key));
        return;
    }
    const std::optional<SectionReader> section =
        openVariant(out_, *entry.value, entry.place, "material", fmt::format("material '{}'", entry.key));
    if (!section) return;

    Material material;
    material.name = entry.key;
    material.place = entry.key_place.resolved();
    const auto take = [&](std::string_view key, SpectrumUse use, Spectrum& into) {
        if (std::optional<Spectrum> s = spectra_.read(*section, key, use)) into = *std::move(s);
    };
    const auto takeColor = [&](std::string_view key, auto& into, TextureIndex& texture) {
        if (section->schema().find(key) == nullptr) return;
        if (TextureReader::isTexture(*section, key))
            texture = textures_.read(*section, key, TexelKind::Spectra).value_or(kNoTexture);
        else if (std::optional<Spectrum> s = spectra_.read(*section, key, SpectrumUse::Reflectance))
            into = *std::move(s);
    };
    const auto takeNumber = [&](std::string_view key, double& number, TextureIndex& texture) {
        const bool textured = section->schema().find(key)->section == "texture";
        if (textured && TextureReader::isTexture(*section, key))
            texture = textures_.read(*section, key, TexelKind::Numbers).value_or(kNoTexture);
        else
            section->read(key, number);
    };
    const std::string kind = variantWord(section->schema());
    for (const auto& [type, word] : kMaterialNames)
        if (kind == word) material.type = type;
    for (const auto& [type, word] : kComposedNames)
        if (kind == word) material.type = type;
    if (kind == "translucent") material.type = MaterialType::Plastic;  // without a coat
    const bool open_pbr = kind == "openpbr";
    takeNumber(open_pbr ? "geometry_opacity" : "opacity", material.opacity, material.opacity_texture);
    if (section->schema().find("normal_map") != nullptr)
        if (const auto map =
                section->section("normal_map", fmt::format("the normal map of {}", section->subject()))) {
            material.normal_texture = textures_.readNormalMap(*map);
            map->read("strength", material.normal_strength);
        }
    const auto add = [&] {
        named.index = static_cast<std::int32_t>(scene_.materials.size());
        scene_.materials.push_back(std::move(material));
    };
    if (open_pbr) {
        readOpenPbr(*section, material);
        add();
        return;
    }
    const bool is_diffuse = material.type == MaterialType::Diffuse;
    if (is_diffuse) section->read("roughness", material.diffuse_roughness);
    else if (section->schema().find("roughness") != nullptr)
        takeNumber("roughness", material.roughness, material.roughness_texture);
    takeColor("reflectance", material.reflectance, material.reflectance_texture);
    takeColor("tint", material.tint, material.tint_texture);
    takeColor("transmittance", material.transmittance, material.transmittance_texture);
    for (const auto& [key, member] : kMaterialNumbers)
        if (section->schema().find(key) != nullptr) section->read(key, material.*member);
    switch (material.type) {
        case MaterialType::Diffuse: makeRoughDiffuse(material); break;
        case MaterialType::RoughConductor:
        case MaterialType::Conductor: {
            std::string metal;
            if (section->readWord("metal", metal))
                std::tie(material.eta, material.k) = metalIndex(metal).value();
            take("eta", SpectrumUse::Index, material.eta);
            take("k", SpectrumUse::Index, material.k);
            break;
        }
        case MaterialType::RoughDielectric:
        case MaterialType::Dielectric:
            material.absorption = spectra_.read(*section, "absorption", SpectrumUse::Absorption);
            [[fallthrough]];
        case MaterialType::ThinDielectric: take("ior", SpectrumUse::Index, material.eta); break;
        case MaterialType::Mix:
            takeNumber("amount", material.amount, material.amount_texture);
            [[fallthrough]];
        case MaterialType::TwoSided: readParts(*section); break;
        case MaterialType::Plastic: {
            double ior = kind == "translucent" ? 1 : 1.5;
            if (kind == "plastic") section->read("ior", ior);
            material.eta = constantSpectrum(ior);
            checkSheet(*section, material);
            break;
        }
        default: break;  // the keys above are all that it has
    }
    if (material.absorption && !material.isOpaque())
        section->error("opacity",
                       "an absorbing body must be closed: light would enter it through holes",
                       "leave 'opacity' or 'absorption' out");
    if (section->schema().find("thin_film") != nullptr) readThinFilm(*section, material);
    if (section->schema().find("roughness_anisotropy") != nullptr) readAnisotropy(*section, material);
    add();
}

void MaterialReader::makeRoughDiffuse(Material& material) {
    if (!(material.diffuse_roughness > 0)) return;
    material.type = MaterialType::Plastic;
    material.eta = constantSpectrum(1);
}

/// Spectra of colours may add up to slightly more than 1 at single wavelengths.
void MaterialReader::checkSheet(const SectionReader& section, Material& material) const {
    if (material.transmittance_texture != kNoTexture || !material.transmittance) return;
    if (!(material.transmittance->max() > 0)) return material.transmittance.reset();
    if (material.reflectance_texture != kNoTexture) return;
    double least = 2, most = 0;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const double sum = material.reflectance[i] + (*material.transmittance)[i];
        least = std::min(least, sum);
        most = std::max(most, sum);
    }
    constexpr double kRounding = 1e-9, kVisible = 1e-3;
    if (least > 1 + kRounding)
        section.error("transmittance",
                      fmt::format("the sheet would send on more light than it receives: 'reflectance' and "
                                  "'transmittance' are together {:.4g} or more",
                                  least),
                      "give two that are together at most 1");
    else if (most > 1 + kVisible)
        logWarning(
            "{}: 'reflectance' and 'transmittance' are together up to {:.4g} at some wavelengths; "
            "crt lets less light through there",
            section.place("transmittance").resolved().text(), most);
}

void MaterialReader::readThinFilm(const SectionReader& section, Material& material) {
    if (!section.has("thin_film")) return;
    const std::optional<SectionReader> film =
        section.section("thin_film", fmt::format("the thin film of material '{}'", material.name));
    if (!film) return;
    film->read("thickness_nm", material.film_thickness_nm);
    if (std::optional<Spectrum> index = spectra_.read(*film, "ior", SpectrumUse::Index))
        material.film_index = *std::move(index);
    if (!TextureReader::isTexture(*film, "relative_thickness")) {
        double relative = 1;
        film->read("relative_thickness", relative);
        material.film_thickness_nm *= relative;
    } else if (material.type == MaterialType::RoughDielectric) {
        film->error("relative_thickness",
                    "a thin film on a rough_dielectric needs a uniform thickness, because the energy loss "
                    "of its microfacets is tabulated for one thickness",
                    "remove 'relative_thickness', give a number, or use a dielectric");
    } else {
        material.film_texture =
            textures_.read(*film, "relative_thickness", TexelKind::Numbers).value_or(kNoTexture);
    }
}

void MaterialReader::readAnisotropy(const SectionReader& section, Material& material) const {
    if (!(material.anisotropy > 0)) return;
    if (material.roughness_texture != kNoTexture)
        section.error("roughness_anisotropy",
                      "an anisotropic surface needs a uniform roughness, because the energy loss of its "
                      "microfacets is tabulated",
                      "give 'roughness' a number, or leave 'roughness_anisotropy' out");
    if (material.type == MaterialType::RoughDielectric && material.film_thickness_nm > 0)
        section.error("roughness_anisotropy",
                      "a rough_dielectric under a thin film must be isotropic, because the energy loss of "
                      "its microfacets is tabulated by wavelength",
                      "leave 'thin_film' or 'roughness_anisotropy' out");
}

std::optional<std::int32_t> MaterialReader::find(const std::string& name, const YamlPlace& place,
                                                 bool from_mtl_possible) {
    const auto found = materials_.find(name);
    if (found != materials_.end()) {
        found->second.used = true;
        if (found->second.index < 0) return std::nullopt;
        return found->second.index;
    }
    std::vector<std::string> known =
        out_.worthSuggesting(names_.size()) ? names_ : std::vector<std::string>();
    if (from_mtl_possible) known.push_back("from_mtl");
    out_.error(place, fmt::format("there is no material '{}'", name),
               out_.worthSuggesting(known.size()) ? didYouMean(name, known) : std::string());
    return std::nullopt;
}

/// The radiance of a surface, by whichever key says how bright it is.
void MaterialReader::readBrightness(const SectionReader& light, const std::function<double()>& area_m2,
                                    Emission& emission) {
    if (std::optional<Spectrum> radiance = spectra_.read(light, "radiance", SpectrumUse::Emission)) {
        emission.radiance = *std::move(radiance);
        return;
    }
    const std::size_t errors = out_.count();
    Spectrum spectrum = illuminantSpectrum("D65").value();
    if (std::optional<Spectrum> given = spectra_.read(light, "spectrum", SpectrumUse::Emission))
        spectrum = *std::move(given);
    if (out_.count() != errors) return;
    for (const char* key : {"luminance_cd_m2", "luminous_flux_lm", "power_w"}) {
        double amount = 0;
        if (!light.read(key, amount)) continue;
        const std::string_view word = key;
        double unit = word == "power_w" ? integralOverWavelengths(spectrum) : photometric(spectrum);
        if (!(unit > 0))
            return light.error(light.has("spectrum") ? "spectrum" : key,
                               fmt::format("this spectrum has no light that '{}' measures", key));
        if (word != "luminance_cd_m2") {
            if (!area_m2)
                return light.error(key, "the area of a part is not known when it is read",
                                   "give 'luminance_cd_m2' or 'radiance'");
            const double area = area_m2();
            if (!(area > 0 && std::isfinite(area)))
                return light.error(key, "the object has no area that this makes shine");
            unit *= std::numbers::pi * area * (emission.two_sided ? 2 : 1);
        }
        const double factor = amount / unit;
        if (!(factor * spectrum.max() <= kMostRadiance))
            return light.error(key, "this is too bright for the area that emits");
        emission.radiance = scaled(spectrum, factor);
    }
}

/// The factor on the radiance: of the whole surface, or by place.
void MaterialReader::readEmittedColor(const SectionReader& light, Emission& emission) {
    for (const char* key : {"luminous_flux_lm", "power_w"})
        if (light.has(key) && light.has("color"))
            light.error(key, "the flux of a surface with 'color' is not known when it is read",
                        "give 'luminance_cd_m2' or 'radiance', of white; or its 'spectrum' instead of "
                        "'color'");
    if (!TextureReader::isTexture(light, "color")) {
        const std::optional<Spectrum> color = spectra_.read(light, "color", SpectrumUse::Reflectance);
        if (color)
            for (std::size_t i = 0; i < kSpectrumSize; ++i) emission.radiance[i] *= (*color)[i];
        return;
    }
    const std::optional<TextureIndex> index = textures_.read(light, "color", TexelKind::Spectra);
    if (!index) return;
    Texture texture = scene_.textures[static_cast<std::size_t>(*index)];
    if (texture.kind != Texture::Kind::Image || texture.factor)
        return light.error("color", "what emits is an image without 'vertex_colors', or one colour",
                           "write {texture: FILE}");
    texture.factor = TextureValue{emission.radiance, kNoTexture};
    emission.texture = static_cast<TextureIndex>(scene_.textures.size());
    scene_.textures.push_back(std::move(texture));
}

std::optional<std::int32_t> MaterialReader::readEmission(const SectionReader& section, std::int32_t material,
                                                         const std::string& material_name,
                                                         const std::function<double()>& area_m2) {
    const std::optional<SectionReader> light =
        section.section("emission", fmt::format("the emission of {}", section.subject()));
    if (!light) return std::nullopt;
    Emission emission;
    light->read("two_sided", emission.two_sided);
    readBrightness(*light, area_m2, emission);
    readEmittedColor(*light, emission);
    if (material >= 0 && scene_.materials[static_cast<std::size_t>(material)].emission >= 0)
        section.error("emission", fmt::format("material '{}' emits light already", material_name),
                      "leave 'emission' or the material's 'emission_luminance' out");
    scene_.emissions.push_back(std::move(emission));
    return static_cast<std::int32_t>(scene_.emissions.size() - 1);
}

void MaterialReader::finish() const {
    UnusedNames unused("material", "materials");
    for (const std::string& name : names_)
        if (const NamedMaterial& material = materials_.at(name); !material.used)
            unused.add(name, material.place);
    unused.finish();
}

}  // namespace crt
