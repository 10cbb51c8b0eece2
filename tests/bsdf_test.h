/// All kinds of materials, and a surface of each at which tests scatter light. A new material is a line in
/// subjects().
///
/// Over 450 lines: the list of materials, a line each, with the truth about each.
#pragma once

#include "kernel_test.h"
#include "quadrature.h"
#include "verify/references.h"

#include <algorithm>
#include <array>
#include <complex>
#include <functional>
#include <vector>

namespace bsdf_test {

using crt::Material;
using crt::MaterialType;

inline double lane(vec4 v, u32 i) { return i == 0 ? V4X(v) : i == 1 ? V4Y(v) : i == 2 ? V4Z(v) : V4W(v); }

/// Unpolarised Fresnel reflectance for a complex index, from the field amplitudes.
inline double fresnel(double cosine, std::complex<double> index) {
    const double s2 = 1 - cosine * cosine;
    const std::complex<double> root = std::sqrt(index * index - s2);
    const auto rs = (cosine - root) / (cosine + root),
               rp = (index * index * cosine - root) / (index * index * cosine + root);
    return (std::norm(rs) + std::norm(rp)) / 2;
}

inline Material make(MaterialType type, const std::function<void(Material&)>& fill) {
    Material m;
    m.type = type;
    m.reflectance = m.eta = m.k = crt::constantSpectrum(0);
    fill(m);
    return m;
}

inline Material reflecting(MaterialType type, double reflectance) {
    return make(type, [&](Material& m) { m.reflectance = crt::constantSpectrum(reflectance); });
}
inline Material metal(MaterialType type, double eta, double k) {
    return make(type, [&](Material& m) {
        m.eta = crt::constantSpectrum(eta);
        m.k = crt::constantSpectrum(k);
    });
}
inline Material roughMetal(double eta, double k, double roughness) {
    Material m = metal(MaterialType::RoughConductor, eta, k);
    m.roughness = roughness;
    return m;
}
inline Material glass(double first, double last, MaterialType type = MaterialType::Dielectric) {
    return make(type, [&](Material& m) {
        m.eta = crt::constantSpectrum(first);
        for (std::size_t i = 0; i < m.eta.values.size(); ++i)
            m.eta[i] = first + (last - first) * static_cast<double>(i) / 470;
    });
}

inline Material roughGlass(double first, double last, double roughness) {
    Material m = glass(first, last, MaterialType::RoughDielectric);
    m.roughness = roughness;
    return m;
}

inline Material colored(double f0, double tint, double weight, double roughness) {
    Material m = reflecting(MaterialType::RoughConductor, f0);
    m.by_color = true;
    m.edge_tint = crt::constantSpectrum(tint);
    m.weight = weight;
    m.roughness = roughness;
    return m;
}

inline Material brushed(Material m, double anisotropy, double rotation_deg = 0) {
    m.anisotropy = anisotropy;
    m.anisotropy_rotation_deg = rotation_deg;
    return m;
}

inline Material plastic(double reflectance, double roughness, double ior = 1.5) {
    Material m = reflecting(MaterialType::Plastic, reflectance);
    m.eta = crt::constantSpectrum(ior);
    m.roughness = roughness;
    return m;
}

inline Material glossy(double color, double roughness) {
    Material m = plastic(color, roughness);
    m.by_color = true;
    return m;
}

inline Material clay(Material m, double roughness) {
    m.diffuse_roughness = roughness;
    return m;
}

inline Material tinted(Material m, double tint) {
    m.tint = crt::constantSpectrum(tint);
    return m;
}

/// Its roughness is a texture, of this many twentieths everywhere, and not its number.
inline Material varying(Material m, crt::TextureIndex twentieths) {
    m.roughness = 0.9;
    m.roughness_texture = twentieths;
    return m;
}

/// A thin sheet.
inline Material sheet(Material m, double transmittance) {
    m.transmittance = crt::constantSpectrum(transmittance);
    return m;
}

inline Material fuzzy(Material m, double weight, double color, double roughness) {
    m.fuzz = weight;
    m.fuzz_color = crt::constantSpectrum(color);
    m.fuzz_roughness = roughness;
    return m;
}

inline Material lacquered(Material m, const crt::verify::Lacquer& lacquer) {
    crt::Clearcoat& coat = m.clearcoat.emplace();
    coat.ior = lacquer.ior;
    coat.roughness = lacquer.roughness;
    coat.depth = crt::constantSpectrum(-std::log(lacquer.color) / 2);
    coat.darkening = lacquer.darkening;
    coat.base_roughness = lacquer.base_roughness;
    return m;
}

/// The same coat, of a roughness that is a texture. The layers below get rougher by it.
inline Material lacqueredByPlace(Material m, crt::verify::Lacquer lacquer, crt::TextureIndex twentieths) {
    lacquer.roughness = 0.9;
    m = lacquered(m, lacquer);
    m.clearcoat->roughness_texture = twentieths;
    m.clearcoat->roughens = true;
    return m;
}

inline Material filmed(Material m, double thickness_nm, double index) {
    m.film_thickness_nm = thickness_nm;
    m.film_index = crt::constantSpectrum(index);
    return m;
}

/// As prepared by Bench, λ − 360 nm: whole nanometres, where tables have their nodes.
constexpr std::array<std::size_t, 4> kPositions{20, 120, 230, 400};

/// (Index behind the surface over that before it)², at a wavelength of the bench: what lies between
/// radiance and what refraction keeps.
inline double indexSquare(const Material& m, u32 lane) {
    if (m.type != MaterialType::Dielectric && m.type != MaterialType::RoughDielectric) return 1;
    return m.eta[kPositions[lane]] * m.eta[kPositions[lane]];
}

struct Subject {
    const char* name;
    Material material;
    /// The share of light from everywhere that is scattered, by the cosine of w_o, which is below 0 inside.
    std::function<double(double)> albedo;
    /// The share of it that goes into single directions, beside a lobe.
    std::function<double(double)> single = [](double) { return 0.0; };
    bool reciprocal = true;
    /// True if the remaining light depends on its direction.
    bool tinted = false;
};

/// All that the tests ask of, one line each.
inline std::vector<Subject> subjects() {
    const auto constant = [](double a) { return [a](double) { return a; }; };
    const auto of_metal = [](double n, double k) {
        return [n, k](double cosine) { return fresnel(std::abs(cosine), {n, k}); };
    };
    const auto rough = [](double n, double k, double roughness) {
        return [=](double cosine) {
            return crt::verify::roughConductorAlbedo(std::abs(cosine), n, k, roughness);
        };
    };
    const auto coated = [](double base, double roughness) {
        return [=](double cosine) {
            return crt::verify::plasticAlbedo(std::abs(cosine), base, 1.5, roughness);
        };
    };
    const auto of_film = [](double n, double k, double thickness_nm, double index) {
        return [=](double cosine) {
            return crt::verify::filmReflectance(std::abs(cosine), index, thickness_nm, 360 + 230, {n, k});
        };
    };
    // A perfect metal's facets mirror all light: of a tint it is as if that were their reflectance.
    const auto of_tinted = [](double tint, double roughness) {
        return [=](double cosine) {
            return crt::verify::tintedMetalAlbedo(std::abs(cosine), 1, 1, tint, roughness);
        };
    };
    const auto coat = [](double cosine) { return fresnel(std::abs(cosine), 1.5); };
    const auto none = [](double) { return 0.0; };
    const auto passed = [](double cosine, double weight, double roughness) {
        return 1 - weight * crt::verify::sheenAlbedo(std::abs(cosine), roughness);
    };
    const auto mirrored = [=](double cosine) { return 0.9 * passed(cosine, 0.5, 1); };
    const auto on_mirror = [=](double cosine) {
        return mirrored(cosine) + 0.7 * (1 - passed(cosine, 0.5, 1));
    };
    const auto under_fuzz = [=](double cosine) { return coat(cosine) * passed(cosine, 1, 0.7); };
    const auto of_gloss = [](double color, double roughness) {
        return [=](double cosine) {
            const double gloss =
                crt::verify::microfacetShares(std::abs(cosine), 1.5, roughness).reflected;
            return gloss + (1 - gloss) * color;
        };
    };
    using crt::verify::Lacquer;
    const auto lacquer_on = [](const Lacquer& lacquer, double base) {
        return [=](double cosine) { return lacquer.albedo(std::abs(cosine), base); };
    };
    const auto gloss_of = [](const Lacquer& lacquer) {
        return [=](double cosine) { return lacquer.mirrored(std::abs(cosine)); };
    };
    // Of a mirror the light has the same cosine both ways.
    const auto under = [](const Lacquer& lacquer, double base) {
        return [=](double cosine) {
            const double c = std::abs(cosine), passed = lacquer.passed(c);
            return (1 - lacquer.mirrored(c)) * lacquer.darkened(c, base) * base * passed * passed;
        };
    };
    const auto sum = [](auto a, auto b) { return [=](double cosine) { return a(cosine) + b(cosine); }; };
    const Lacquer clear{}, satin{.ior = 1.5, .roughness = 0.5};
    const Lacquer amber{.ior = 1.4, .roughness = 0.4, .color = 0.5, .darkening = 0.7};
    const Lacquer varnish{.color = 0.6, .darkening = 0.5, .base_roughness = 0};
    const Lacquer frosted{.ior = 1.7, .roughness = 0.6, .color = 0.7, .base_roughness = 0.3};
    const auto on_white_fuzz = [=](double cosine) {
        return clear.mirrored(std::abs(cosine)) * passed(cosine, 0.5, 0.6);
    };
    // The views are at azimuth 0.7, and the bench's tangent is x.
    const auto of_brushed = [](double n, double k, double roughness, double anisotropy, double turn_deg) {
        return [=](double cosine) {
            const double sine = std::sqrt(1 - cosine * cosine), phi = 0.7 - turn_deg * kPi / 180;
            return crt::verify::brushedAlbedo({sine * std::cos(phi), sine * std::sin(phi), std::abs(cosine)},
                                              n, k, roughness, anisotropy);
        };
    };
    return {
        {"diffuse", reflecting(MaterialType::Diffuse, 0.7), constant(0.7)},
        {"white diffuse", reflecting(MaterialType::Diffuse, 1), constant(1)},
        {"mirror", reflecting(MaterialType::Mirror, 0.9), constant(0.9)},
        {"conductor", metal(MaterialType::Conductor, 0.2, 3), of_metal(0.2, 3)},
        {"rough conductor of roughness 0", roughMetal(0.2, 3, 0), of_metal(0.2, 3)},
        // Narrower lobes fall between the directions of overCells; `crt verify` has them (G12).
        {"rough conductor of roughness 0.2", roughMetal(0.2, 3, 0.2), rough(0.2, 3, 0.2)},
        {"rough conductor of roughness 0.5", roughMetal(0.2, 3, 0.5), rough(0.2, 3, 0.5)},
        {"rough conductor of roughness 1", roughMetal(0.2, 3, 1), rough(0.2, 3, 1)},
        {"rough perfect metal", roughMetal(1, 1e6, 1), constant(1)},
        {"brushed metal", brushed(roughMetal(0.2, 3, 0.6), 0.7), of_brushed(0.2, 3, 0.6, 0.7, 0)},
        {"brushed metal, turned", brushed(roughMetal(0.2, 3, 1), 0.8, 65), of_brushed(0.2, 3, 1, 0.8, 65)},
        {"brushed perfect metal", brushed(roughMetal(1, 1e6, 1), 0.9), constant(1)},
        {"brushed glass", brushed(roughGlass(1.5, 1.5, 0.8), 0.6, 25), constant(1)},
        {"brushed dispersive glass", brushed(roughGlass(1.7, 1.6, 0.7), 0.5), constant(1)},
        {"a film on brushed perfect metal", filmed(brushed(roughMetal(1, 1e6, 0.6), 0.8), 500, 1.5),
         constant(1)},
        {"polished metal by its colours", colored(0.6, 0.3, 0.8, 0),
         [](double cosine) { return 0.8 * crt::verify::f82Tint(std::abs(cosine), 0.6, 0.3); }},
        {"rough metal by its colours", colored(0.6, 0.3, 0.8, 0.7),
         [](double cosine) { return crt::verify::tintedMetalAlbedo(std::abs(cosine), 0.6, 0.3, 0.8, 0.7); }},
        {"white brushed metal by its colours", brushed(colored(1, 1, 1, 0.8), 0.7), constant(1)},
        {"glossy", glossy(0.6, 0.5), of_gloss(0.6, 0.5)},
        {"clay", clay(plastic(0.7, 0, 1), 0.6),
         [](double cosine) { return crt::verify::eonAlbedo(std::abs(cosine), 0.7, 0.6); }},
        {"white clay", clay(plastic(1, 0, 1), 1), constant(1)},
        {"nearly smooth white clay", clay(plastic(1, 0, 1), 2e-6), constant(1)},
        {"glazed clay", clay(glossy(0.6, 0), 0.8),
         [](double cosine) { return crt::verify::glossyEonAlbedo(std::abs(cosine), 0.6, 0.8, 1.5); }, coat},
        {"white clay under satin", clay(glossy(1, 0.5), 1), constant(1)},
        {"white fuzz on white", fuzzy(reflecting(MaterialType::Diffuse, 1), 1, 1, 0.5), constant(1), none,
         false},
        {"dust on a mirror", fuzzy(reflecting(MaterialType::Mirror, 0.9), 0.5, 0.7, 1), on_mirror, mirrored,
         false},
        {"fuzz on rough metal", fuzzy(roughMetal(1, 1e6, 0.6), 1, 1, 0.4), constant(1), none, false},
        {"fuzz on plastic", fuzzy(plastic(1, 0), 1, 1, 0.7), constant(1), under_fuzz, false},
        {"fuzz on rough glass", fuzzy(roughGlass(1.5, 1.5, 0.5), 1, 1, 0.6), constant(1), none, false},
        {"lacquer on white", lacquered(reflecting(MaterialType::Diffuse, 1), clear), constant(1),
         gloss_of(clear), false},
        {"satin lacquer on white", lacquered(reflecting(MaterialType::Diffuse, 1), satin), constant(1), none,
         false},
        {"lacquer on grey", lacquered(reflecting(MaterialType::Diffuse, 0.5), clear), lacquer_on(clear, 0.5),
         gloss_of(clear), false},
        {"amber lacquer on grey", lacquered(reflecting(MaterialType::Diffuse, 0.6), amber),
         lacquer_on(amber, 0.6), none, false, true},
        {"varnish on a mirror", lacquered(reflecting(MaterialType::Mirror, 0.9), varnish),
         sum(gloss_of(varnish), under(varnish, 0.9)), sum(gloss_of(varnish), under(varnish, 0.9)), false,
         true},
        {"frosted lacquer on a mirror", lacquered(reflecting(MaterialType::Mirror, 0.9), frosted),
         sum(gloss_of(frosted), under(frosted, 0.9)), under(frosted, 0.9), false, true},
        {"lacquer on rough metal", lacquered(roughMetal(1, 1e6, 0.6), clear), constant(1), gloss_of(clear),
         false},
        {"satin lacquer on white brushed metal by its colours",
         lacquered(brushed(colored(1, 1, 1, 0.8), 0.7), satin), constant(1), none, false},
        {"satin lacquer on plastic", lacquered(glossy(1, 0), satin), constant(1),
         [=](double cosine) { return (1 - satin.mirrored(std::abs(cosine))) * coat(cosine); }, false},
        {"satin lacquer on clay", lacquered(clay(plastic(1, 0, 1), 1), satin), constant(1), none, false},
        {"white fuzz on lacquer on white",
         fuzzy(lacquered(reflecting(MaterialType::Diffuse, 1), clear), 0.5, 1, 0.6), constant(1),
         on_white_fuzz, false},
        {"white fuzz on satin lacquer on rough metal",
         fuzzy(lacquered(roughMetal(1, 1e6, 0.6), satin), 1, 1, 0.5), constant(1), none, false},
        {"glass", glass(1.5, 1.5), constant(1)},
        {"dispersive glass", glass(1.7, 1.6), constant(1)},
        {"rough glass of roughness 0", roughGlass(1.5, 1.5, 0), constant(1)},
        {"rough glass of index 1", roughGlass(1, 1, 0.5), constant(1)},
        {"rough glass of roughness 0.5", roughGlass(1.5, 1.5, 0.5), constant(1)},
        {"rough glass of roughness 1", roughGlass(2.4, 2.4, 1), constant(1)},
        {"a rough bubble in glass", roughGlass(1 / 1.5, 1 / 1.5, 0.6), constant(1)},
        {"dispersive rough glass", roughGlass(1.7, 1.6, 0.5), constant(1)},
        {"oxide on metal", filmed(metal(MaterialType::Conductor, 0.2, 3), 300, 2), of_film(0.2, 3, 300, 2)},
        {"a film on rough perfect metal", filmed(roughMetal(1, 1e6, 0.6), 500, 1.5), constant(1)},
        {"a film on glass", filmed(glass(1.5, 1.5), 400, 1.33), constant(1)},
        {"a film on dispersive glass", filmed(glass(1.7, 1.6), 400, 1.33), constant(1)},
        {"a film on rough glass", filmed(roughGlass(1.5, 1.5, 0.6), 400, 2.2), constant(1)},
        {"a film on dispersive rough glass", filmed(roughGlass(1.7, 1.6, 0.5), 400, 1.33), constant(1)},
        {"plastic", plastic(0.6, 0), coated(0.6, 0), coat},
        {"white plastic", plastic(1, 0), constant(1), coat},
        {"black plastic", plastic(0, 0.5), coated(0, 0.5)},
        {"rough plastic", plastic(0.6, 0.5), coated(0.6, 0.5)},
        {"white rough plastic", plastic(1, 0.7), constant(1)},
        {"plastic without a coat", plastic(0.7, 0.3, 1), constant(0.7)},
        {"tinted conductor", tinted(metal(MaterialType::Conductor, 0.2, 3), 0.6),
         [=](double cosine) { return 0.6 * of_metal(0.2, 3)(cosine); }},
        {"tinted rough perfect metal", tinted(roughMetal(1, 1e6, 0.5), 0.6), of_tinted(0.6, 0.5)},
        {"tinted plastic", tinted(plastic(0.6, 0), 0.3),
         [=](double cosine) { return coated(0.6, 0)(cosine) - 0.7 * coat(cosine); },
         [=](double cosine) { return 0.3 * coat(cosine); }},
        {"tinted rough plastic", tinted(plastic(0.6, 0.5), 0.3),
         [=](double cosine) {
             return coated(0.6, 0.5)(cosine) -
                    0.7 * crt::verify::microfacetShares(std::abs(cosine), 1.5, 0.5).reflected;
         }},
        {"paper", sheet(plastic(0.4, 0, 1), 0.5), constant(0.9)},
        {"white paper", sheet(plastic(0.25, 0, 1), 0.75), constant(1)},
        {"what lets all light through", sheet(plastic(0, 0, 1), 1), constant(1)},
        {"a leaf", sheet(plastic(0.2, 0), 0.4), coated(0.6, 0), coat},
        {"a white leaf", sheet(plastic(0.5, 0), 0.5), constant(1), coat},
        {"a satin leaf", sheet(plastic(0.4, 0.5), 0.2), coated(0.6, 0.5)},
        {"a white satin leaf", sheet(plastic(0.1, 0.7), 0.9), constant(1)},
        {"a leaf by its colours", sheet(glossy(0.35, 0.35), 0.25), of_gloss(0.6, 0.35)},
        {"a leaf, rough by place", sheet(varying(plastic(0.2, 0), 7), 0.4), coated(0.6, 0.35)},
        {"a tinted leaf", sheet(tinted(plastic(0.2, 0), 0.3), 0.4),
         [=](double cosine) { return coated(0.6, 0)(cosine) - 0.7 * coat(cosine); },
         [=](double cosine) { return 0.3 * coat(cosine); }},
        {"plastic, rough by place", varying(plastic(0.6, 0), 7), coated(0.6, 0.35)},
        {"white plastic, rough by place", varying(plastic(1, 0), 13), constant(1)},
        {"plastic, polished by place", varying(plastic(0.6, 0), 0), coated(0.6, 0), coat},
        {"gloss, rough by place", varying(glossy(0.6, 0), 7), of_gloss(0.6, 0.35)},
        {"gloss, rough by place, as rough as can be", varying(glossy(0.6, 0), 20), of_gloss(0.6, 1)},
        {"satin lacquer by place on white", lacqueredByPlace(reflecting(MaterialType::Diffuse, 1), clear, 9),
         constant(1), none, false},
        {"amber lacquer by place on grey",
         lacqueredByPlace(reflecting(MaterialType::Diffuse, 0.6), amber, 8), lacquer_on(amber, 0.6), none,
         false, true},
        {"lacquer by place on rough metal", lacqueredByPlace(roughMetal(1, 1e6, 0.3), clear, 6), constant(1),
         none, false},
        {"lacquer by place on gloss by place", lacqueredByPlace(varying(glossy(1, 0), 5), clear, 6),
         constant(1), none, false},
    };
}

/// A triangle of one material, and its BSDF at a point.
class Bench {
public:
    /// `normal`: what is interpolated.
    explicit Bench(const Material& material, const Vec3d& normal = {0, 0, 1}) {
        crt::Mesh mesh;
        mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};  // its normal is +z
        mesh.triangles = {{0, 1, 2}};
        crt::Scene scene = sceneOf(mesh);
        scene.materials = {material};
        scene.objects[0].material = 0;
        for (int i = 0; i <= 20; ++i) {
            crt::Texture& even = scene.textures.emplace_back();
            even.kind = crt::Texture::Kind::Checker;
            even.values = {crt::TextureValue{crt::constantSpectrum(i / 20.0), crt::kNoTexture},
                           crt::TextureValue{crt::constantSpectrum(i / 20.0), crt::kNoTexture}};
        }
        compiled_ = crt::compileScene(scene, 0);
        ctx_ = contextOf(compiled_);
        CrtHit hit = crt_no_hit(CRT_INFINITY);
        hit.slot = hit.id = 0;
        hit.b1 = hit.b2 = 0.3f;
        surface_ = crt_surface(&ctx_, hit);
        surface_.ns = toFloat(normal);
    }
    /// Of a path that carries the same at all wavelengths, or nothing but the hero's.
    CrtBsdf prepare(const Vec3d& wo, bool alone = false) const {
        return prepare(wo, alone ? make_vec4(0, 0, 4, 0) : splat4(1));
    }
    CrtBsdf prepare(const Vec3d& wo, vec4 carried) const {
        CrtBsdf bsdf{};
        crt_layered_prepare(&ctx_, &bsdf, &surface_, unitFloat(wo), positions(), carried, 1);
        return bsdf;
    }
    /// The same as a vertex of a path.
    CrtVertex vertex(const Vec3d& wo, bool alone = false) const {
        CrtVertex vertex{};
        vertex.surface = surface_;
        vertex.wo = unitFloat(wo);
        crt_vertex_prepare(&ctx_, &vertex, 0, positions(), alone ? make_vec4(0, 0, 4, 0) : splat4(1), 0, 1);
        return vertex;
    }
    static constexpr u32 kHero = 2;
    static CrtScatter sample(const CrtBsdf& bsdf, CrtRandom2 u, CrtRandom2 choice, int alone = 0) {
        return crt_layered_sample(&bsdf, u, choice, make_vec4(0, 0, 1, 0), alone);
    }
    static CrtScatter sampleSurface(const CrtBsdf& bsdf, CrtRandom2 u, CrtRandom2 choice) {
        return crt_surface_sample(&bsdf, u, choice, make_vec4(0, 0, 1, 0), 0);
    }

private:
    static vec4 positions() {
        return make_vec4(static_cast<f32>(kPositions[0]), static_cast<f32>(kPositions[1]),
                         static_cast<f32>(kPositions[2]), static_cast<f32>(kPositions[3]));
    }

    crt::CompiledScene compiled_;
    CrtContext ctx_{};
    CrtSurface surface_{};
};

/// Directions of view, from both sides of the surface.
inline std::vector<Vec3d> views() {
    std::vector<Vec3d> all;
    for (const double cosine : {0.98, 0.6, 0.2})
        for (const double side : {1.0, -1.0}) all.push_back(spherical(side * cosine, 0.7));
    return all;
}

/// Of two errors the worse, and NaN where one is none.
inline double fartherFrom0(double a, double b) { return std::abs(b) <= a ? a : std::abs(b); }

/// Chance of a single direction, of a flat surface.
inline double chanceOfSingle(const CrtBsdf& b) {
    double chance = (b.flags & CRT_BSDF_DELTA) != 0 ? 1 : 0;
    if (b.type == CRT_MATERIAL_PLASTIC && b.coat.table == nullptr) chance = b.coat_chance;
    if (crt_is_coated(&b))
        chance = (1 - double{b.clear_chance}) * chance + (crt_is_coat_lobe(&b) ? 0 : b.clear_chance);
    return crt_is_fuzzy(&b) ? (1 - double{b.fuzz_chance}) * chance : chance;
}

inline bool isDelta(const CrtBsdf& bsdf) { return crt_is_delta(&bsdf) != 0; }

}  // namespace bsdf_test
