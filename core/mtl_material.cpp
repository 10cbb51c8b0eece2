#include "mtl_material.h"

#include "error.h"
#include "log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <vector>

namespace crt {
namespace {

using MtlColour = const tinyobj::real_t (&)[3];

/// MTL colours are numbers between 0 and 1 that come out of colour pickers: sRGB-encoded by habit, and read as such.
Vec3d linearColour(MtlColour encoded) {
    Vec3d rgb;
    for (int i = 0; i < 3; ++i) rgb[i] = srgbToLinear(std::clamp(encoded[i], 0.0, 1.0));
    return rgb;
}

/// Ke goes beyond 1 where an exporter multiplied it by a strength: the colour is decoded, the strength stays linear.
Vec3d linearEmission(MtlColour encoded) {
    const double strength = std::max({1.0, encoded[0], encoded[1], encoded[2]});
    Vec3d rgb;
    for (int i = 0; i < 3; ++i) rgb[i] = strength * srgbToLinear(std::max(0.0, encoded[i]) / strength);
    return rgb;
}

double brightest(MtlColour c) { return std::max({c[0], c[1], c[2]}); }

bool inRange(MtlColour c) {
    return std::all_of(std::begin(c), std::end(c), [](double x) { return x >= 0.0 && x <= 1.0; });
}

/// Maps one material, and gathers what is lost on the way.
class MaterialMapper {
public:
    MaterialMapper(const tinyobj::material_t& mtl, const MtlSource& source) : mtl_(mtl), source_(source) {}

    MtlMaterial map() {
        MtlMaterial mapped;
        mapped.material = material();
        if (brightest(mtl_.emission) > 0.0) mapped.emission = Emission{rgbEmission(linearEmission(mtl_.emission)), false};
        mapped.spectrum_file = spectrum_file_;
        return mapped;
    }

private:
    Material material() {
        for (const double x : {mtl_.diffuse[0], mtl_.diffuse[1], mtl_.diffuse[2], mtl_.specular[0], mtl_.specular[1],
                               mtl_.specular[2], mtl_.emission[0], mtl_.emission[1], mtl_.emission[2], mtl_.dissolve, mtl_.ior,
                               mtl_.shininess, mtl_.roughness, mtl_.metallic})
            if (!std::isfinite(x)) refuse("a number that is not finite");

        Material m;
        m.name = mtl_.name;
        m.place = {source_.file, source_.line};
        const bool glass = mtl_.dissolve < 1.0 || mtl_.illum == 4 || mtl_.illum == 6 || mtl_.illum == 7 || mtl_.illum == 9;
        const bool metallic = mtl_.metallic >= 0.5;
        const bool polished = (mtl_.illum == 3 || mtl_.illum == 5) && brightest(mtl_.diffuse) <= 0.1 &&
                              brightest(mtl_.specular) > 0.0;
        if (glass)
            dielectric(m);
        else if (metallic || polished)
            mirror(m, metallic);
        else
            diffuse(m);
        if (!mtl_.diffuse_texname.empty() || !mtl_.specular_texname.empty() || !mtl_.emissive_texname.empty() ||
            !mtl_.alpha_texname.empty() || !mtl_.bump_texname.empty() || !mtl_.normal_texname.empty() ||
            !mtl_.roughness_texname.empty() || !mtl_.metallic_texname.empty())
            lost_.push_back("its textures are left out");
        if (!lost_.empty())
            logWarning("{}:{}: material '{}' is approximated: {}", source_.file, source_.line, mtl_.name, fmt::join(lost_, "; "));
        return m;
    }

    bool has(const char* statement) const { return source_.statements.contains(statement); }

    [[noreturn]] void refuse(const std::string& what) const {
        throw Error(ErrorKind::Scene, fmt::format("material '{}' has {}", mtl_.name, what), {source_.file, source_.line});
    }

    void dielectric(Material& m) {
        m.type = MaterialType::Dielectric;
        const double index = has("Ni") ? mtl_.ior : 1.5;
        if (!(index > 0.0)) refuse(fmt::format("a refractive index Ni of {}", index));
        m.eta = constantSpectrum(index);
        if (mtl_.dissolve > 0.0 && mtl_.dissolve < 1.0) lost_.push_back(fmt::format("d = {:g} becomes clear glass", mtl_.dissolve));
        if (has("Tf") && !(mtl_.transmittance[0] == 1.0 && mtl_.transmittance[1] == 1.0 && mtl_.transmittance[2] == 1.0))
            lost_.push_back("the filter colour Tf is left out");
        if (has("crt_reflectance")) lost_.push_back("glass has no crt_reflectance");
        smooth();
    }

    void mirror(Material& m, bool metallic) {
        m.type = MaterialType::Mirror;
        m.reflectance = reflectance(metallic ? mtl_.diffuse : mtl_.specular, metallic ? "Kd" : "Ks");
        if (metallic && mtl_.metallic < 1.0) lost_.push_back(fmt::format("metalness {:g} is taken as 1", mtl_.metallic));
        smooth();
    }

    void diffuse(Material& m) {
        m.type = MaterialType::Diffuse;
        m.reflectance = reflectance(mtl_.diffuse, "Kd");
        if (mtl_.metallic > 0.0) lost_.push_back(fmt::format("metalness {:g} is taken as 0", mtl_.metallic));
        // illum 0 and 1 say that there is no highlight, whatever Ks holds.
        if (mtl_.illum >= 2 && brightest(mtl_.specular) > 0.0)
            lost_.push_back(fmt::format("its gloss (Ks{}) is left out",
                                        roughness() ? fmt::format(", roughness {:.2g}", *roughness()) : ""));
    }

    /// Pr, or what Blender's exporter makes of roughness in Ns = 1000 (1 − roughness)².
    std::optional<double> roughness() const {
        if (has("Pr")) return mtl_.roughness;
        if (has("Ns")) return 1.0 - std::sqrt(std::clamp(mtl_.shininess / 1000.0, 0.0, 1.0));
        return std::nullopt;
    }

    void smooth() {
        constexpr double kVisible = 0.05;
        if (roughness().value_or(0.0) > kVisible) lost_.push_back(fmt::format("roughness {:.2g} is taken as 0", *roughness()));
    }

    Spectrum reflectance(MtlColour colour, const char* name) {
        if (has("crt_reflectance")) {
            spectrum_file_ = (std::filesystem::path(source_.file).parent_path() / source_.measured_reflectance).string();
            const Spectrum s = readSpectrumFile(spectrum_file_, Outside::Clamp);
            if (s.min() < 0.0 || s.max() > 1.0) throw Error(ErrorKind::Scene, "a reflectance must lie in [0, 1]", {spectrum_file_});
            return s;
        }
        if (!inRange(colour)) lost_.push_back(fmt::format("{} is clamped to [0, 1]", name));
        return rgbReflectance(linearColour(colour));
    }

    const tinyobj::material_t& mtl_;
    const MtlSource& source_;
    std::string spectrum_file_;
    std::vector<std::string> lost_;
};

}  // namespace

MtlMaterial mapMtlMaterial(const tinyobj::material_t& mtl, const MtlSource& source) { return MaterialMapper(mtl, source).map(); }

}  // namespace crt
