/// The materials of a scene, and what surfaces emit.
#pragma once

#include "scene/scene.h"
#include "scene/yaml/scene_spectra.h"
#include "scene/yaml/scene_textures.h"

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crt {

class MaterialReader {
public:
    MaterialReader(Diagnostics& out, SpectrumReader& spectra, TextureReader& textures, Scene& scene)
        : out_(out), spectra_(spectra), textures_(textures), scene_(scene) {}

    void read(const YamlNode& map);
    /// Index of a material, which is used from then on. Nothing if it is unknown, which is reported, or
    /// wrong.
    std::optional<std::int32_t> find(const std::string& name, const YamlPlace& place,
                                     bool from_mtl_possible);
    /// In the order of the file.
    const std::vector<std::string>& names() const { return names_; }
    /// Of a surface with the scene's material `material`, −1 none, that is called `material_name`.
    /// `area_m2`: of what emits, each side once; empty where a flux cannot be given.
    std::optional<std::int32_t> readEmission(const SectionReader& section, std::int32_t material,
                                             const std::string& material_name,
                                             const std::function<double()>& area_m2);
    /// Warns about materials that no object uses.
    void finish() const;

private:
    void readMaterial(const YamlEntry& entry);
    void readParts(const SectionReader& material);
    void resolveParts();
    void checkParts(const std::vector<std::int32_t>& way);
    std::vector<const Material*> glassOf(const Material& material) const;
    void checkInsides(std::int32_t whole, const YamlPlace& place) const;
    void readThinFilm(const SectionReader& section, Material& material);
    /// A diffuse material that is rough is a plastic without a coat.
    static void makeRoughDiffuse(Material& material);
    void readBrightness(const SectionReader& light, const std::function<double()>& area_m2,
                        Emission& emission);
    void readEmittedColor(const SectionReader& light, Emission& emission);
    void readAnisotropy(const SectionReader& section, Material& material) const;
    /// Refuses a thin sheet that would make light.
    void checkSheet(const SectionReader& section, Material& material) const;
    struct OpenPbr;
    /// Makes the material of what OpenPBR's keys say, and of further ones, which come before it.
    void readOpenPbr(const SectionReader& section, Material& material);
    bool transmits(const Material& part) const;

    struct NamedMaterial {
        std::int32_t index = -1;  ///< −1: known, but wrong.
        YamlPlace place;
        bool used = false;
    };

    Diagnostics& out_;
    SpectrumReader& spectra_;
    TextureReader& textures_;
    Scene& scene_;
    std::map<std::string, NamedMaterial> materials_;
    std::vector<std::string> names_;
    /// By the number of a material that is made of others: what they are called, and where.
    struct PartName {
        std::string name;
        YamlPlace place;
    };
    std::map<std::int32_t, std::array<PartName, 2>> parts_;
};

}  // namespace crt
