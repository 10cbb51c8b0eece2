// The part of MaterialReader that reads openpbr materials (OpenPBR Surface 1.1): they become crt's own,
// mixed as the specification says. Parameters that crt lacks are refused where they would be visible.
#include "scene/light_units.h"
#include "scene/yaml/scene_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace crt {
namespace {

/// A number, or an image of them.
struct Weight {
    double value = 0;
    TextureIndex texture = kNoTexture;

    bool isTextured() const { return texture != kNoTexture; }
    bool mayBeAbove0() const { return isTextured() || value > 0; }
    bool mayBeBelow1() const { return isTextured() || value < 1; }
};

/// Index that reflects `weight` times as much straight on as `ior` does.
double modulatedIndex(double ior, double weight) {
    const double amplitude = std::abs((1 - ior) / (1 + ior));
    const double changed = std::copysign(std::min(1.0, std::sqrt(weight) * amplitude), ior - 1);
    return (1 + changed) / (1 - changed);
}

double reflectedStraightOn(double index) { return (1 - index) * (1 - index) / ((1 + index) * (1 + index)); }

/// −ln of what is left.
double opticalDepth(double left) {
    constexpr double kLeast = 1e-30;  // single precision has next to nothing below
    return left < 1 ? -std::log(std::max(left, kLeast)) : 0.0;
}

/// Cauchy's two terms, from the index at Fraunhofer's line d and Abbe's number.
Spectrum dispersed(double ior, double abbe) {
    constexpr double d_um = 0.5876, F_um = 0.4861, C_um = 0.6563;
    const double b = (ior - 1) / (abbe * (1 / (F_um * F_um) - 1 / (C_um * C_um)));
    return cauchyIndex({ior - b / (d_um * d_um), b});
}

bool isWhite(const Spectrum& s) { return s.min() == 1 && s.max() == 1; }

}  // namespace

/// The values of the keys, and the materials made of them.
struct MaterialReader::OpenPbr {
    MaterialReader& reader;
    const SectionReader& section;
    Material like;  ///< Properties that all its parts share.
    double base_weight = 1, diffuse_roughness = 0;
    Spectrum base_color = constantSpectrum(0.8), specular_color = constantSpectrum(1);
    TextureIndex base_texture = kNoTexture, specular_texture = kNoTexture;
    Weight metalness{}, transmission{}, roughness{0.3};
    double specular_weight = 1, ior = 1.5;
    Spectrum transmission_color = constantSpectrum(1);
    double transmission_depth = 0, dispersion_scale = 0, abbe = 20;
    double film_weight = 0, film_um = 0.5, film_ior = 1.4;
    Weight subsurface{};
    Spectrum subsurface_color = constantSpectrum(0.8);
    TextureIndex subsurface_texture = kNoTexture;
    double subsurface_forward = 0;  ///< Share of it that comes out on the other side.
    bool thin_walled = false;
    Weight coat{};
    Spectrum coat_color = constantSpectrum(1);
    Weight coat_roughness{};
    double coat_anisotropy = 0, coat_ior = 1.6, coat_darkening = 1;

    double emission_luminance = 0;
    Spectrum emission_color = rgbEmission({1, 1, 1});

    void read();
    void refuse() const;
    template <class No>
    void refuseCoat(const No& no) const;
    Material make();
    std::int32_t emission() const;

private:
    void number(const char* key, Weight& into) const;
    void color(const char* key, Spectrum& into) const;
    void color(const char* key, Spectrum& into, TextureIndex& texture) const;
    bool hasVaryingGloss() const {
        return roughness.isTextured() || (coat.mayBeAbove0() && coat_roughness.isTextured());
    }
    bool isMetal() const { return metalness.mayBeAbove0(); }
    bool isOpaque() const { return metalness.mayBeBelow1() && transmission.mayBeBelow1(); }
    bool isClear() const { return metalness.mayBeBelow1() && transmission.mayBeAbove0(); }
    /// Under a coat, of the two indices that is above 1 which says how they differ: light that comes through
    /// the coat is never reflected totally by what lies below.
    double index(bool coated = false) const {
        const double ratio = coated ? std::max(ior / coat_ior, coat_ior / ior) : ior;
        return modulatedIndex(ratio, specular_weight);
    }
    void setColor(Material& part) const;
    void setRoughness(Material& part, bool coated) const;
    void setCoat(Material& part, double share) const;
    Material metal(bool coated) const;
    Material glossy(bool coated) const;
    Material sheet(bool coated) const;
    void setGloss(Material& part, bool coated) const;
    Material clear(bool under_film) const;
    Material base(bool coated) const;
    Material mixed(const char* what, Material first, Material second, const Weight& amount) const;
};

void MaterialReader::OpenPbr::number(const char* key, Weight& into) const {
    if (TextureReader::isTexture(section, key))
        into.texture = reader.textures_.read(section, key, TexelKind::Numbers).value_or(kNoTexture);
    else
        section.read(key, into.value);
}

void MaterialReader::OpenPbr::color(const char* key, Spectrum& into) const {
    if (std::optional<Spectrum> s = reader.spectra_.read(section, key, SpectrumUse::Reflectance))
        into = *std::move(s);
}

void MaterialReader::OpenPbr::color(const char* key, Spectrum& into, TextureIndex& texture) const {
    if (TextureReader::isTexture(section, key))
        texture = reader.textures_.read(section, key, TexelKind::Spectra).value_or(kNoTexture);
    else
        color(key, into);
}

void MaterialReader::OpenPbr::read() {
    section.read("base_weight", base_weight);
    color("base_color", base_color, base_texture);
    section.read("base_diffuse_roughness", diffuse_roughness);
    number("base_metalness", metalness);
    section.read("specular_weight", specular_weight);
    color("specular_color", specular_color, specular_texture);
    number("specular_roughness", roughness);
    section.read("specular_roughness_anisotropy", like.anisotropy);
    section.read("anisotropy_rotation_deg", like.anisotropy_rotation_deg);
    section.read("specular_ior", ior);
    number("transmission_weight", transmission);
    color("transmission_color", transmission_color);
    section.read("transmission_depth", transmission_depth);
    section.read("transmission_dispersion_scale", dispersion_scale);
    section.read("transmission_dispersion_abbe_number", abbe);
    section.read("fuzz_weight", like.fuzz);
    like.fuzz_color = constantSpectrum(1);
    color("fuzz_color", like.fuzz_color);
    like.fuzz_roughness = 0.5;
    section.read("fuzz_roughness", like.fuzz_roughness);
    section.read("emission_luminance", emission_luminance);
    if (std::optional<Spectrum> s =
            reader.spectra_.read(section, "emission_color", SpectrumUse::Emission))
        emission_color = *std::move(s);
    number("subsurface_weight", subsurface);
    color("subsurface_color", subsurface_color, subsurface_texture);
    double anisotropy = 0;
    section.read("subsurface_scatter_anisotropy", anisotropy);
    subsurface_forward = (1 + anisotropy) / 2;
    section.read("geometry_thin_walled", thin_walled);
    number("coat_weight", coat);
    color("coat_color", coat_color);
    number("coat_roughness", coat_roughness);
    section.read("coat_roughness_anisotropy", coat_anisotropy);
    section.read("coat_ior", coat_ior);
    section.read("coat_darkening", coat_darkening);
    section.read("thin_film_weight", film_weight);
    section.read("thin_film_thickness", film_um);
    section.read("thin_film_ior", film_ior);
}

template <class No>
void MaterialReader::OpenPbr::refuseCoat(const No& no) const {
    const bool has = coat.mayBeAbove0();
    no(has && isClear(), "coat_weight",
       "crt does not support a coat on a clear base: crt's coats lie on what is opaque",
       "leave 'coat_weight' or 'transmission_weight' out");
    no(has && (coat_ior < 1 || coat_ior > 10), "coat_ior", "a coat needs an index of 1 to 10",
       "give 'coat_ior' from 1 to 10");
    no(has && coat_roughness.mayBeAbove0() && coat_anisotropy > 0, "coat_roughness_anisotropy",
       "a coat must be isotropic, because its reflection is tabulated",
       "leave 'coat_roughness_anisotropy' out");
    no(has && isMetal() && coat_roughness.isTextured() && like.anisotropy > 0, "coat_roughness",
       "an anisotropic metal needs a coat of uniform roughness, because the energy loss of its microfacets "
       "is "
       "tabulated",
       "give 'coat_roughness' a number, or leave 'specular_roughness_anisotropy' out");
    no(has && emission_luminance > 0, "emission_luminance",
       "the coat would take some of the emitted light, and crt supports emission only from the top layer",
       "leave 'coat_weight' or 'emission_luminance' out");
}

/// Each sentence is about what would be seen: keys of a slab that is not there may say anything.
void MaterialReader::OpenPbr::refuse() const {
    const auto no = [&](bool seen, const char* key, const char* why, const char* instead) {
        if (seen) section.error(key, why, instead);
    };
    no(subsurface.mayBeAbove0() && !thin_walled, "subsurface_weight",
       "crt does not support subsurface scattering in bodies, where light wanders below a surface",
       "remove 'subsurface_weight', which makes the base diffuse; or write 'geometry_thin_walled: true' for "
       "a leaf or paper");
    no(subsurface.mayBeAbove0() && coat.mayBeAbove0(), "coat_weight",
       "crt does not support a coat on what lets light through", "leave 'coat_weight' out");
    no(thin_walled && isClear() && roughness.mayBeAbove0(), "specular_roughness",
       "a clear material that is thin-walled must be smooth", "give 'specular_roughness' 0");
    no(emission_luminance > 0 && like.fuzz > 0, "emission_luminance",
       "the fuzz would take some of the emitted light, and crt supports emission only from the top layer",
       "leave 'fuzz_weight' or 'emission_luminance' out");
    refuseCoat(no);
    const auto indices = [&](auto&& are) {
        return (coat.mayBeBelow1() && are(index())) || (coat.mayBeAbove0() && are(index(true)));
    };
    const bool coated = isOpaque() && indices([](double n) { return n != 1; });
    no(base_texture != kNoTexture && base_weight != 1, "base_weight",
       "crt does not multiply a texture by 'base_weight'", "leave 'base_weight' out");
    no(isMetal() && specular_weight > 1, "specular_weight",
       "a metal would reflect more light than it receives", "give 'specular_weight' 1 or less");
    no(isClear() && (!isWhite(specular_color) || specular_texture != kNoTexture), "specular_color",
       "crt supports 'specular_color' for what is opaque only",
       "leave 'specular_color' or 'transmission_weight' out");
    no(isMetal() && specular_texture != kNoTexture, "specular_color",
       "a metal needs a uniform 'specular_color'", "give a colour, or leave 'base_metalness' out");
    no(coated && like.anisotropy > 0, "specular_roughness_anisotropy",
       "the gloss on an opaque base must be isotropic, because its reflection is tabulated",
       "leave it out, or give 'base_metalness' or 'transmission_weight' 1");
    no(coated && diffuse_roughness > 0 && hasVaryingGloss(), "base_diffuse_roughness",
       "a rough diffuse base needs a gloss of uniform roughness, because what it loses is tabulated",
       "leave 'base_diffuse_roughness' out, or give 'specular_roughness' and 'coat_roughness' numbers");
    no(coated && indices([](double n) { return n < 1 || n > 10; }), "specular_ior",
       "the index of the gloss on an opaque base must be 1 to 10, including the effect of 'specular_weight'",
       "give 'specular_ior' of at least 1, and a smaller 'specular_weight'");
    no(isClear() && !(index() <= 1e3 && index() >= 1e-3), "specular_weight",
       "this changes the index to beyond 0.001 to 1000", "give a smaller 'specular_weight'");
    no(isClear() && !thin_walled && !isWhite(transmission_color) && transmission_depth == 0,
       "transmission_color", "a depth of 0 would tint the surface itself instead of the inside",
       "give 'transmission_depth', the distance after which light has this colour");
    no(isClear() && !thin_walled && transmission_depth > 0 && !(transmission_color.min() > 0),
       "transmission_color", "black is opaque at any depth", "give a colour above 0 at every wavelength");
    no(isClear() && dispersion_scale > 0 && !(dispersed(index(), abbe / dispersion_scale).min() > 1e-3),
       "transmission_dispersion_abbe_number", "the index would fall below 0.001",
       "give a larger Abbe number");
    const bool film = film_weight > 0 && film_um > 0;
    no((isMetal() || isClear()) && like.anisotropy > 0 && roughness.isTextured(),
       "specular_roughness_anisotropy",
       "an anisotropic surface needs a uniform roughness, because the energy loss of its microfacets is "
       "tabulated",
       "give 'specular_roughness' a number, or leave 'specular_roughness_anisotropy' out");
    no(isClear() && film && like.anisotropy > 0, "specular_roughness_anisotropy",
       "a clear dielectric under a thin film must be isotropic",
       "leave 'thin_film_weight' or 'specular_roughness_anisotropy' out");
    no(film && (isMetal() || coated), "thin_film_weight",
       "crt supports thin films on clear dielectrics, and on metals with a complex index",
       "give 'transmission_weight' 1, or use a rough_conductor with 'thin_film'");
    const bool absorbs = isClear() && !thin_walled && transmission_depth > 0 && !isWhite(transmission_color);
    no(absorbs && !like.isOpaque(), "geometry_opacity",
       "an absorbing body must be closed: light would enter it through holes",
       "leave 'geometry_opacity' or 'transmission_color' out");
}

void MaterialReader::OpenPbr::setColor(Material& part) const {
    part.reflectance_texture = base_texture;
    part.reflectance = scaled(base_color, base_weight);
}

/// Light passes a rough coat twice, in and out.
void MaterialReader::OpenPbr::setRoughness(Material& part, bool coated) const {
    part.roughness = roughness.value;
    part.roughness_texture = roughness.texture;
    const double above = coat_roughness.value;
    if (coated && coat_roughness.mayBeAbove0() && !hasVaryingGloss())
        part.roughness = std::min(1.0, std::sqrt(std::hypot(roughness.value * roughness.value,
                                                            std::numbers::sqrt2 * above * above)));
}

/// The base under the coat counts as rough by this share of its roughness, and for the rest as rough as can
/// be.
void MaterialReader::OpenPbr::setCoat(Material& part, double share) const {
    Clearcoat& it = part.clearcoat.emplace();
    it.ior = coat_ior;
    it.roughness = coat_roughness.value;
    it.roughness_texture = coat_roughness.texture;
    it.roughens = hasVaryingGloss() && coat_roughness.mayBeAbove0();
    it.depth = coat_color.isConstant() ? constantSpectrum(opticalDepth(coat_color[0]) / 2) : coat_color;
    if (!coat_color.isConstant())
        for (double& depth : it.depth.values) depth = opticalDepth(depth) / 2;
    it.darkening = coat_darkening;
    it.base_roughness = std::lerp(1.0, roughness.value, share);
    it.base_share = share;
}

Material MaterialReader::OpenPbr::metal(bool coated) const {
    Material part = like;
    part.type = MaterialType::RoughConductor;
    part.by_color = true;
    part.edge_tint = specular_color;
    part.weight = specular_weight;
    setColor(part);
    setRoughness(part, coated);
    if (coated) setCoat(part, 1);
    return part;
}

Material MaterialReader::OpenPbr::glossy(bool coated) const {
    Material part = like;
    setColor(part);
    part.diffuse_roughness = diffuse_roughness;
    const double n = index(coated);
    if (coated) setCoat(part, reflectedStraightOn(n));
    if (n == 1)
        makeRoughDiffuse(part);
    else
        setGloss(part, coated);
    return part;
}

void MaterialReader::OpenPbr::setGloss(Material& part, bool coated) const {
    part.type = MaterialType::Plastic;
    part.by_color = true;
    part.eta = constantSpectrum(index(coated));
    part.tint_texture = specular_texture;
    if (!isWhite(specular_color)) part.tint = specular_color;
    setRoughness(part, coated);
}

/// The subsurface of a thin wall: diffuse reflection and transmission of one colour, below the gloss.
Material MaterialReader::OpenPbr::sheet(bool coated) const {
    const auto side = [&](double here, double there) {
        Material part = like;
        setGloss(part, coated);
        part.reflectance = scaled(subsurface_color, here);
        part.transmittance = scaled(subsurface_color, there);
        if (here == 1) part.reflectance_texture = subsurface_texture;
        if (there == 1) part.transmittance_texture = subsurface_texture;
        if (there == 0) part.transmittance.reset();
        return part;
    };
    if (subsurface_texture == kNoTexture) return side(1 - subsurface_forward, subsurface_forward);
    return mixed("sheet", side(1, 0), side(0, 1), {subsurface_forward});
}

Material MaterialReader::OpenPbr::clear(bool under_film) const {
    Material part = like;
    if (under_film) {
        part.film_thickness_nm = 1000 * film_um;
        part.film_index = constantSpectrum(film_ior);
    }
    if (thin_walled) {
        part.type = MaterialType::ThinDielectric;
        part.eta = constantSpectrum(index());
        if (!isWhite(transmission_color)) part.tint = transmission_color;
        return part;
    }
    part.type = MaterialType::RoughDielectric;
    part.eta = dispersion_scale > 0 ? dispersed(index(), abbe / dispersion_scale)
                                    : constantSpectrum(index());
    setRoughness(part, false);
    if (!roughness.mayBeAbove0()) part.type = MaterialType::Dielectric;
    if (transmission_depth > 0 && !isWhite(transmission_color)) {
        Spectrum absorption;
        for (std::size_t i = 0; i < kSpectrumSize; ++i)
            absorption[i] = -std::log(transmission_color[i]) / transmission_depth;
        part.absorption = transmission_color.isConstant() ? constantSpectrum(absorption[0]) : absorption;
    }
    return part;
}

Material MaterialReader::OpenPbr::mixed(const char* what, Material first, Material second,
                                      const Weight& amount) const {
    if (!amount.mayBeAbove0()) return first;
    if (!amount.mayBeBelow1()) return second;
    Material whole = like;
    whole.type = MaterialType::Mix;
    whole.amount = amount.value;
    whole.amount_texture = amount.texture;
    for (std::size_t i = 0; i < 2; ++i) {
        Material& part = i == 0 ? first : second;
        part.name = fmt::format("{} ({} {})", like.name, what, i);
        part.opacity = 1;
        part.opacity_texture = kNoTexture;
        whole.parts[i] = static_cast<std::int32_t>(reader.scene_.materials.size());
        reader.scene_.materials.push_back(std::move(part));
    }
    return whole;
}

Material MaterialReader::OpenPbr::base(bool coated) const {
    Material dielectric = glossy(coated);
    if (subsurface.mayBeAbove0())
        dielectric = mixed("subsurface", std::move(dielectric), sheet(coated), subsurface);
    if (isClear()) {
        const Weight film{film_um > 0 ? film_weight : 0};
        Material translucent = film.value > 0
                                   ? mixed("film", clear(false), clear(true), film) : clear(false);
        dielectric = mixed("transmission", std::move(dielectric), std::move(translucent), transmission);
    }
    return mixed(coated ? "coated metalness" : "metalness", std::move(dielectric), metal(coated), metalness);
}

Material MaterialReader::OpenPbr::make() {
    if (!coat.mayBeAbove0()) return base(false);
    if (!coat.mayBeBelow1()) return base(true);
    Material bare = base(false);
    return mixed("coat", std::move(bare), base(true), coat);
}

/// The luminance is that of a colour of luminance 1, as white is.
std::int32_t MaterialReader::OpenPbr::emission() const {
    if (!(emission_luminance > 0) || !(emission_color.max() > 0)) return -1;
    const double factor = emission_luminance / luminanceOfUnitY_cd_m2();
    reader.scene_.emissions.push_back({scaled(emission_color, factor), false});
    return static_cast<std::int32_t>(reader.scene_.emissions.size()) - 1;
}

void MaterialReader::readOpenPbr(const SectionReader& section, Material& material) {
    OpenPbr it{.reader = *this, .section = section, .like = material};
    it.read();
    it.refuse();
    material = it.make();
    material.emission = it.emission();
}

}  // namespace crt
