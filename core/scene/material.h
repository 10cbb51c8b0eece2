/// A material of the host's scene (scene.h), in the author's units.
#pragma once

#include "base/error.h"
#include "kernel/dialect/features.h"
#include "scene/texture.h"
#include "spectra/spectra.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace crt {

/// The kernel's kinds of materials, by its numbers.
enum class MaterialType : std::uint32_t {
#define CRT_MATERIAL_TYPE(F, bit, NAME, Name, word, scatter, text) Name = bit,
    CRT_MATERIAL_LIST(CRT_MATERIAL_TYPE, )
#undef CRT_MATERIAL_TYPE
    // Made of others; the kernel finds one of those at each vertex.
    Mix = 0x100,
    TwoSided,
};

/// Their names in scene files.
inline constexpr std::pair<MaterialType, const char*> kMaterialNames[] = {
#define CRT_MATERIAL_NAME(F, bit, NAME, Name, word, scatter, text) {MaterialType::Name, #word},
    CRT_MATERIAL_LIST(CRT_MATERIAL_NAME, )
#undef CRT_MATERIAL_NAME
};
/// True if it scatters light to all sides, and not in single directions alone.
constexpr bool scattersLobe(MaterialType type) {
    return static_cast<std::uint32_t>(type) < 64 &&
           (CRT_FEATURES_LOBE >> static_cast<std::uint32_t>(type) & 1) != 0;
}
inline constexpr std::pair<MaterialType, const char*> kComposedNames[] = {
    {MaterialType::Mix, "mix"}, {MaterialType::TwoSided, "two_sided"}};
/// Largest depth of nesting of mixes and two-sided materials.
inline constexpr int kDeepestComposition = 8;
/// Largest depth of the mixes that an openpbr material becomes.
inline constexpr int kDeepestOpenPbr = 4;

/// The coat of OpenPBR Surface 1.1 (kernel/materials/clearcoat.h), on what reflects alone.
struct Clearcoat {
    double ior = 1.6;       ///< At least 1.
    double roughness = 0;   ///< In [0,1].
    TextureIndex roughness_texture = kNoTexture;  ///< In place of the roughness.
    Spectrum depth;         ///< The transmittance at normal incidence is exp(−depth).
    double darkening = 1;   ///< Fraction of the light sent back to the base, and absorbed by the base, that
                            ///< is lost.
    /// Effective roughness of the layers below, for the darkening. In [0,1].
    double base_roughness = 1;
    /// Of a material with a textured roughness: this share of the texture, and 1 for the rest.
    double base_share = 1;
    /// True if the material's own roughness is that without the coat, to which each vertex adds the coat's.
    bool roughens = false;
};

struct Material {
    std::string name;
    MaterialType type = MaterialType::Diffuse;
    Spectrum reflectance;  ///< Diffuse, Mirror, and the base of Plastic. In [0,1].
    Spectrum eta;  ///< Conductors: real index n. Dielectrics: index of the inside relative to the outside;
                 ///< Plastic: of the coat.
    Spectrum k;            ///< Conductors: extinction.
    std::optional<Spectrum> absorption;  ///< Dielectric, RoughDielectric. Per scene unit, at least 0.
    double roughness = 0;  ///< Rough kinds, and the coat of Plastic. In [0,1].
    /// By OpenPBR's colours. Plastic: the reflectance is the share of what enters that comes out again.
    /// RoughConductor: the reflectance is F₀, straight on, and there are `edge_tint`, of Schlick's curve
    /// at 82°, and `weight` in place of eta and k; no film.
    bool by_color = false;
    Spectrum edge_tint;
    double weight = 1;
    /// On what metals and gloss mirror and on what panes let through; nothing: 1. In [0,1].
    std::optional<Spectrum> tint;
    TextureIndex tint_texture = kNoTexture;  ///< In place of the tint.
    /// Plastic: what the base lets through, a thin sheet, beside its reflectance; nothing: 0. In [0,1]; it
    /// lets through at most what it does not reflect.
    std::optional<Spectrum> transmittance;
    TextureIndex transmittance_texture = kNoTexture;  ///< In place of the transmittance.
    double anisotropy = 0;  ///< Rough kinds. In [0,1]: how much narrower GGX is across the tangent.
    double anisotropy_rotation_deg = 0;  ///< From the coordinates' tangent, counter-clockwise seen from
                                         ///< the outside.
    double film_thickness_nm = 0;  ///< Metals and dielectrics; 0: there is no film.
    Spectrum film_index;           ///< Relative to the outside.
    TextureIndex reflectance_texture = kNoTexture;  ///< In place of the reflectance.
    TextureIndex roughness_texture = kNoTexture;    ///< In place of the roughness.
    TextureIndex film_texture = kNoTexture;         ///< Factor on the thickness of the film.
    SourcePlace place;
    double opacity = 1;  ///< Share of the surface that is there. In [0,1].
    TextureIndex opacity_texture = kNoTexture;  ///< In place of the opacity.
    /// Mix; TwoSided: front and back. Indices into Scene::materials. Not of a material that is itself, or is
    /// made of, this one.
    std::array<std::int32_t, 2> parts{-1, -1};
    TextureIndex normal_texture = kNoTexture;   ///< In tangent space, OpenGL's convention.
    double normal_strength = 1;                 ///< Of its slopes. At least 0.
    double amount = 0.5;                        ///< Mix: share of the second. In [0,1].
    TextureIndex amount_texture = kNoTexture;   ///< In place of the amount.
    /// Index into Scene::emissions: what faces emit that name this material; −1 nothing. Not of parts.
    std::int32_t emission = -1;
    /// Plastic by its colours, and one of index 1: how rough the diffuse base is. In [0,1].
    double diffuse_roughness = 0;
    double fuzz = 0;            ///< Share of the surface that fuzz lies on. In [0,1].
    Spectrum fuzz_color;        ///< In [0,1].
    double fuzz_roughness = 0;  ///< In [0,1].
    std::optional<Clearcoat> clearcoat;  ///< Below the fuzz. Not of what transmits.

    bool isComposed() const { return type == MaterialType::Mix || type == MaterialType::TwoSided; }
    bool isOpaque() const { return opacity >= 1 && opacity_texture == kNoTexture; }
    /// True if its roughness depends on the place.
    bool hasVaryingRoughness() const {
        return roughness_texture != kNoTexture || (clearcoat && clearcoat->roughens);
    }
    /// The textures that it names itself; kNoTexture among them.
    std::array<TextureIndex, 9> textures() const {
        return {reflectance_texture,
                transmittance_texture,
                roughness_texture,
                tint_texture,
                film_texture,
                opacity_texture,
                amount_texture,
                normal_texture,
                clearcoat ? clearcoat->roughness_texture : kNoTexture};
    }
    /// True if it is a thin sheet that scatters light to both sides.
    bool isTranslucent() const {
        return type == MaterialType::Plastic && (transmittance || transmittance_texture != kNoTexture);
    }
    /// True if something that it mirrors or lets through is tinted.
    bool isTinted() const {
        const bool mirrors = type == MaterialType::Conductor || type == MaterialType::RoughConductor ||
                             type == MaterialType::Plastic || type == MaterialType::ThinDielectric;
        return mirrors && (tint || tint_texture != kNoTexture);
    }
    /// True if light comes out on the other side.
    bool transmits() const { return isClear() || isTranslucent(); }
    /// True if it comes out there as through glass.
    bool isClear() const {
        return type == MaterialType::Dielectric || type == MaterialType::RoughDielectric ||
               type == MaterialType::ThinDielectric;
    }
};

/// Numbers that a key of scene files sets, in sections that have the key.
inline constexpr std::pair<const char*, double Material::*> kMaterialNumbers[] = {
    {"roughness_anisotropy", &Material::anisotropy},
    {"anisotropy_rotation_deg", &Material::anisotropy_rotation_deg},
};

/// Calls visit(member) for the members that decide what a material looks like. Structured bindings name
/// every member: a new member does not compile until it is here.
template <class Visit>
void visitMembers(const Clearcoat& coat, const Visit& visit) {
    const auto& [ior, roughness, roughness_texture, depth, darkening, base_roughness, base_share, roughens] =
        coat;
    for (const double number : {ior, roughness, darkening, base_roughness, base_share}) visit(number);
    visit(roughness_texture);
    visit(depth);
    visit(roughens);
}
template <class Visit>
void visitMembers(const Material& material, const Visit& visit) {
    const auto& [name, type, reflectance, eta, k, absorption, roughness, by_color, edge_tint, weight, tint,
                 tint_texture, transmittance, transmittance_texture, anisotropy, anisotropy_rotation_deg,
                 film_thickness_nm, film_index, reflectance_texture, roughness_texture, film_texture, place,
                 opacity, opacity_texture, parts, normal_texture, normal_strength, amount, amount_texture,
                 emission, diffuse_roughness, fuzz, fuzz_color, fuzz_roughness, clearcoat] = material;
    visit(type);
    visit(by_color);
    for (const Spectrum* spectrum : {&reflectance, &eta, &k, &edge_tint, &film_index, &fuzz_color})
        visit(*spectrum);
    for (const double number : {roughness, weight, anisotropy, anisotropy_rotation_deg, film_thickness_nm,
                                opacity, normal_strength, amount, diffuse_roughness, fuzz, fuzz_roughness})
        visit(number);
    for (const TextureIndex texture :
         {reflectance_texture, transmittance_texture, roughness_texture, tint_texture, film_texture,
          opacity_texture, normal_texture, amount_texture})
        visit(texture);
    for (const std::int32_t index : {parts[0], parts[1], emission}) visit(index);
    for (const std::optional<Spectrum>* spectrum : {&absorption, &tint, &transmittance}) {
        visit(spectrum->has_value());
        if (*spectrum) visit(**spectrum);
    }
    visit(clearcoat.has_value());
    if (clearcoat) visitMembers(*clearcoat, visit);
}

}  // namespace crt
