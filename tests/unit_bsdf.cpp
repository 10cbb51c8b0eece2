// Invariants of every material: tests crt_layered_prepare, _sample, _eval and _pdf of each kind in
// CRT_MATERIAL_LIST. A new material is a line in kSubjects. Backends are held to the same bits elsewhere.
//
// Over 450 lines: one list of materials, and the laws that each of them is asked for.
#include "kernel_test.h"

#include "compile/coat.h"
#include "verify/references.h"

#include <algorithm>
#include <array>
#include <complex>
#include <functional>
#include <set>

using namespace kernel_test;
using crt::Material;
using crt::MaterialType;
using crt::Vec3d;

namespace {

constexpr double kPi = 3.14159265358979323846;

double lane(vec4 v, u32 i) { return i == 0 ? V4X(v) : i == 1 ? V4Y(v) : i == 2 ? V4Z(v) : V4W(v); }

/// Unpolarised Fresnel reflectance for a complex index, from the field amplitudes.
double fresnel(double cosine, std::complex<double> index) {
    const double s2 = 1 - cosine * cosine;
    const std::complex<double> root = std::sqrt(index * index - s2);
    const auto rs = (cosine - root) / (cosine + root),
               rp = (index * index * cosine - root) / (index * index * cosine + root);
    return (std::norm(rs) + std::norm(rp)) / 2;
}

Material make(MaterialType type, const std::function<void(Material&)>& fill) {
    Material m;
    m.type = type;
    m.reflectance = m.eta = m.k = crt::constantSpectrum(0);
    fill(m);
    return m;
}

Material reflecting(MaterialType type, double reflectance) {
    return make(type, [&](Material& m) { m.reflectance = crt::constantSpectrum(reflectance); });
}
Material metal(MaterialType type, double eta, double k) {
    return make(type, [&](Material& m) {
        m.eta = crt::constantSpectrum(eta);
        m.k = crt::constantSpectrum(k);
    });
}
Material roughMetal(double eta, double k, double roughness) {
    Material m = metal(MaterialType::RoughConductor, eta, k);
    m.roughness = roughness;
    return m;
}
Material glass(double first, double last, MaterialType type = MaterialType::Dielectric) {
    return make(type, [&](Material& m) {
        m.eta = crt::constantSpectrum(first);
        for (std::size_t i = 0; i < m.eta.values.size(); ++i)
            m.eta[i] = first + (last - first) * static_cast<double>(i) / 470;
    });
}

Material roughGlass(double first, double last, double roughness) {
    Material m = glass(first, last, MaterialType::RoughDielectric);
    m.roughness = roughness;
    return m;
}

Material colored(double f0, double tint, double weight, double roughness) {
    Material m = reflecting(MaterialType::RoughConductor, f0);
    m.by_color = true;
    m.edge_tint = crt::constantSpectrum(tint);
    m.weight = weight;
    m.roughness = roughness;
    return m;
}

Material brushed(Material m, double anisotropy, double rotation_deg = 0) {
    m.anisotropy = anisotropy;
    m.anisotropy_rotation_deg = rotation_deg;
    return m;
}

Material plastic(double reflectance, double roughness, double ior = 1.5) {
    Material m = reflecting(MaterialType::Plastic, reflectance);
    m.eta = crt::constantSpectrum(ior);
    m.roughness = roughness;
    return m;
}

Material glossy(double color, double roughness) {
    Material m = plastic(color, roughness);
    m.by_color = true;
    return m;
}

Material clay(Material m, double roughness) {
    m.diffuse_roughness = roughness;
    return m;
}

Material fuzzy(Material m, double weight, double color, double roughness) {
    m.fuzz = weight;
    m.fuzz_color = crt::constantSpectrum(color);
    m.fuzz_roughness = roughness;
    return m;
}

Material lacquered(Material m, const crt::verify::Lacquer& lacquer) {
    crt::Clearcoat& coat = m.clearcoat.emplace();
    coat.ior = lacquer.ior;
    coat.roughness = lacquer.roughness;
    coat.depth = crt::constantSpectrum(-std::log(lacquer.color) / 2);
    coat.darkening = lacquer.darkening;
    coat.base_roughness = lacquer.base_roughness;
    return m;
}

Material filmed(Material m, double thickness_nm, double index) {
    m.film_thickness_nm = thickness_nm;
    m.film_index = crt::constantSpectrum(index);
    return m;
}

/// As prepared by Bench, λ − 360 nm: whole nanometres, where tables have their nodes.
constexpr std::array<std::size_t, 4> kPositions{20, 120, 230, 400};

/// (Index behind the surface over that before it)², at a wavelength of the bench: what lies between
/// radiance and what refraction keeps.
double indexSquare(const Material& m, u32 lane) {
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
    u32 numbers = 512;  ///< The square of this number makes its means: more where weights differ much.
};

/// All that the tests ask of, one line each.
std::vector<Subject> subjects() {
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
         [](double cosine) { return crt::verify::eonAlbedo(std::abs(cosine), 0.7, 0.6); }, none, true, false,
         2048},
        {"white clay", clay(plastic(1, 0, 1), 1), constant(1), none, true, false, 2048},
        {"nearly smooth white clay", clay(plastic(1, 0, 1), 2e-6), constant(1)},
        {"glazed clay", clay(glossy(0.6, 0), 0.8),
         [](double cosine) { return crt::verify::glossyEonAlbedo(std::abs(cosine), 0.6, 0.8, 1.5); }, coat},
        {"white clay under satin", clay(glossy(1, 0.5), 1), constant(1), none, true, false, 2048},
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
        {"satin lacquer on clay", lacquered(clay(plastic(1, 0, 1), 1), satin), constant(1), none, false,
         false, 2048},
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
        const vec4 positions =
            make_vec4(static_cast<f32>(kPositions[0]), static_cast<f32>(kPositions[1]),
                      static_cast<f32>(kPositions[2]), static_cast<f32>(kPositions[3]));
        crt_layered_prepare(&ctx_, &bsdf, &surface_, unitFloat(wo), positions, carried, 1);
        return bsdf;
    }
    static constexpr u32 kHero = 2;
    static CrtScatter sample(const CrtBsdf& bsdf, CrtRandom2 u, CrtRandom2 choice, int alone = 0) {
        return crt_layered_sample(&bsdf, u, choice, make_vec4(0, 0, 1, 0), alone);
    }
    static CrtScatter sampleSurface(const CrtBsdf& bsdf, CrtRandom2 u, CrtRandom2 choice) {
        return crt_surface_sample(&bsdf, u, choice, make_vec4(0, 0, 1, 0), 0);
    }

private:
    crt::CompiledScene compiled_;
    CrtContext ctx_{};
    CrtSurface surface_{};
};

Vec3d spherical(double cosine, double phi) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

/// Directions of view, from both sides of the surface.
std::vector<Vec3d> views() {
    std::vector<Vec3d> all;
    for (const double cosine : {0.98, 0.6, 0.2})
        for (const double side : {1.0, -1.0}) all.push_back(spherical(side * cosine, 0.7));
    return all;
}

/// Of two errors the worse, and NaN where one is none.
double fartherFrom0(double a, double b) { return std::abs(b) <= a ? a : std::abs(b); }

/// Chance of a single direction, of a flat surface.
double chanceOfSingle(const CrtBsdf& b) {
    double chance = (b.flags & CRT_BSDF_DELTA) != 0 ? 1 : 0;
    if (b.type == CRT_MATERIAL_PLASTIC && b.coat == nullptr) chance = b.coat_chance;
    if (crt_is_coated(&b))
        chance = (1 - double{b.clear_chance}) * chance + (crt_is_coat_lobe(&b) ? 0 : b.clear_chance);
    return crt_is_fuzzy(&b) ? (1 - double{b.fuzz_chance}) * chance : chance;
}

bool isDelta(const CrtBsdf& bsdf) { return crt_is_delta(&bsdf) != 0; }

/// Integrals over cells of the sphere, equal in solid angle: cosine by azimuth.
constexpr std::size_t kRows = 32, kColumns = 32, kCells = kRows * kColumns, kSteps = 24;
constexpr std::size_t kSubRows = kRows * kSteps, kSubColumns = kColumns * kSteps;
/// The directions of the quadrature, row by row: most of its time would be their sines.
const std::vector<Vec3d>& cellDirections() {
    static const std::vector<Vec3d> all = [] {
        std::vector<Vec3d> directions;
        for (std::size_t i = 0; i < kSubRows; ++i)
            for (std::size_t j = 0; j < kSubColumns; ++j)
                directions.push_back(
                    spherical(-1 + 2 * (static_cast<double>(i) + 0.5) / kSubRows,
                              -kPi + 2 * kPi * (static_cast<double>(j) + 0.5) / kSubColumns));
        return directions;
    }();
    return all;
}
template <class F>
std::array<double, kCells> overCells(const F& f) {
    std::array<double, kCells> cells{};
    const std::vector<Vec3d>& directions = cellDirections();
    for (std::size_t i = 0; i < kSubRows; ++i)
        for (std::size_t j = 0; j < kSubColumns; ++j)
            cells[i / kSteps * kColumns + j / kSteps] +=
                f(directions[i * kSubColumns + j]) * 4 * kPi / (static_cast<double>(kSubRows) * kSubColumns);
    return cells;
}
std::size_t cellOf(const Vec3d& w) {
    const auto at = [](double share, std::size_t n) {
        return std::min(n - 1, static_cast<std::size_t>(std::max(0.0, share) * static_cast<double>(n)));
    };
    return at((w[2] + 1) / 2, kRows) * kColumns + at((std::atan2(w[1], w[0]) + kPi) / (2 * kPi), kColumns);
}
double total(const std::array<double, kCells>& cells) {
    double sum = 0;
    for (const double c : cells) sum += c;
    return sum;
}

/// Over the whole square of random numbers; the second pair along with it, by the sequence R₂ (Roberts
/// 2018).
template <class F>
void overNumbers(F&& f, u32 side = 512) {
    for (u32 i = 0; i < side; ++i)
        for (u32 j = 0; j < side; ++j) {
            const double n = i * side + (j * 197 + i * 61) % side;
            CrtRandom2 u, choice;
            u.x = (static_cast<f32>(i) + 0.5f) / static_cast<f32>(side);
            u.y = (static_cast<f32>(j) + 0.5f) / static_cast<f32>(side);
            const double x = n * 0.7548776662466927, y = n * 0.5698402909980532;
            choice.x = static_cast<f32>(x - std::floor(x));
            choice.y = static_cast<f32>(y - std::floor(y));
            f(u, choice, 1.0 / (static_cast<double>(side) * side));
        }
}

/// Azimuth from which w_o looks along a flat surface's brushing as it does along that of `bsdf`.
double azimuthOnFlat(const CrtBsdf& bsdf, const Bench& flat, const Vec3d& wo) {
    if ((bsdf.flags & CRT_BSDF_ANISOTROPIC) == 0) return 0.7;
    const auto azimuth = [](const CrtBsdf& b, const Vec3d& w) {
        const Vec3d tangent = toDouble(b.tangent);
        return std::atan2(dot(w, cross(toDouble(b.ns), tangent)), dot(w, tangent));
    };
    const Vec3d about{0.6, 0, 0.8};
    return azimuth(bsdf, wo) - azimuth(flat.prepare(about), about);
}

/// χ² of directions against their density in each cell.
void checkDistribution(const std::array<double, kCells>& density,
                       const std::function<CrtScatter()>& sample) {
    constexpr std::uint64_t kSamples = 400000;
    std::array<std::uint64_t, kCells> counts{};
    std::uint64_t rejected = 0;
    for (std::uint64_t i = 0; i < kSamples; ++i) {
        const CrtScatter scatter = sample();
        if (scatter.valid && scatter.pdf > 0) ++counts[cellOf(toDouble(scatter.wi))];
        else ++rejected;
    }
    // Cells of few samples are taken together, with what is rejected.
    std::vector<std::uint64_t> observed{rejected};
    std::vector<double> expected{std::max(0.0, 1 - total(density)) * kSamples};
    for (std::size_t c = 0; c < kCells; ++c) {
        const double e = density[c] * kSamples;
        if (e >= 20) {
            observed.push_back(counts[c]);
            expected.push_back(e);
        } else {
            observed[0] += counts[c];
            expected[0] += e;
        }
    }
    if (expected[0] < 20) {
        CHECK(static_cast<double>(observed[0]) < 60);
        observed.erase(observed.begin());
        expected.erase(expected.begin());
    }
    REQUIRE(observed.size() > 4);
    CHECK(std::abs(chiSquaredDeviate(observed, expected)) < 4.4);
}

}  // namespace

TEST_CASE("BSDF: every kind of material is asked", "[kernel][bsdf][materials]") {
    std::set<MaterialType> asked{MaterialType::ThinDielectric};  // is passed: unit_panes.cpp
    for (const Subject& s : subjects()) asked.insert(s.material.type);
    CHECK(asked.size() == std::size(crt::kMaterialNames));
}

TEST_CASE("BSDF: directions are distributed as the pdf says", "[kernel][bsdf][materials]") {
    Random random(71);
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            if (isDelta(bsdf)) continue;
            INFO(s.name << " from " << wo[2]);
            const auto density =
                overCells([&](const Vec3d& w) { return crt_layered_pdf(&bsdf, unitFloat(w)); });
            // Together with the chance of a single direction.
            CHECK(total(density) < 1 - chanceOfSingle(bsdf) + 1e-3);
            checkDistribution(density, [&] { return Bench::sample(bsdf, random.pair(), random.pair()); });
        }
    }
}

TEST_CASE("BSDF: about interpolated normals nothing that is reflected is lost",
          "[kernel][bsdf][materials]") {
    Random random(74);
    for (const Subject& s : subjects()) {
        if (s.material.transmits() || s.tinted) continue;
        const Bench flat(s.material);
        for (const double tilt : {0.35, 1.1})
            // From before the normal, and from behind it on the other side.
            for (const Vec3d& wo : {spherical(0.6, 0.7), spherical(-0.2, 0.7)}) {
                const Vec3d normal = spherical(std::cos(tilt), 0.2);
                // From behind the normal, of kinds that only mirror it is the face's.
                const bool mirrors = s.material.type == MaterialType::Conductor ||
                                     s.material.type == MaterialType::Mirror;
                const bool face = mirrors && wo[2] < 0;
                const double cosine = face ? -wo[2] : std::abs(dot(wo, normal));
                const Bench bench(s.material, normal);
                const CrtBsdf bsdf = bench.prepare(wo);
                const CrtBsdf upright = flat.prepare(spherical(cosine, azimuthOnFlat(bsdf, flat, wo)));
                INFO(s.name << " at " << tilt << " from " << wo[2]);
                double kept = 0, expected = 0, single = 0, worst_pdf = 0;
                std::uint64_t below = 0;
                overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
                    const CrtScatter there = Bench::sampleSurface(bsdf, u, choice),
                                     here = Bench::sample(upright, u, choice);
                    if (here.valid) expected += share * V4X(here.weight);
                    if (!there.valid) return;
                    kept += share * V4X(there.weight);
                    if (there.pdf == 0) single += share * V4X(there.weight);
                    below += there.wi.z * wo[2] <= 0 || std::abs(length(toDouble(there.wi)) - 1) > 1e-6;
                    if (there.pdf > 0)
                        worst_pdf = fartherFrom0(worst_pdf,
                                                 crt_surface_pdf(&bsdf, there.wi) / double{there.pdf} - 1);
                }, s.numbers);
                CHECK(kept == Approx(expected).epsilon(1e-3));
                CHECK(below == 0);
                CHECK(worst_pdf < 1e-3);
                if (isDelta(bsdf)) continue;
                const auto above = [&](const auto& f) {
                    return overCells(
                        [&](const Vec3d& w) -> double { return w[2] * wo[2] > 0 ? f(unitFloat(w)) : 0; });
                };
                const auto density = above([&](vec3 w) -> double { return crt_surface_pdf(&bsdf, w); });
                const double lobe =
                    total(above([&](vec3 w) -> double { return V4X(crt_surface_eval(&bsdf, w)); }));
                CHECK(lobe + single == Approx(expected).epsilon(0.01));
                checkDistribution(density, [&] {
                    return Bench::sampleSurface(bsdf, random.pair(), random.pair());
                });
            }
    }
}

TEST_CASE("BSDF: Lambert's light is raised without a seam, and where it came from is known",
          "[kernel][bsdf]") {
    Random random(75);
    for (const double tilt : {0.01, 0.2, 1.1}) {
        const Vec3d normal = spherical(std::cos(tilt), 0.2);
        const Bench bench(reflecting(MaterialType::Diffuse, 1), normal);
        const CrtBsdf bsdf = bench.prepare({0, 0, 1});
        CHECK(crt_below(&bsdf) == Approx((1 - std::cos(tilt)) / 2).epsilon(1e-3));
        for (int i = 0; i < 2000; ++i) {
            const double depth = std::sin(tilt) * (i % 2 == 0 ? 1 : 1e-3) * random.uniform();
            const Vec3d w = spherical(-depth, random.uniform(-kPi, kPi));
            const double before = dot(w, normal);
            if (!(before > 1e-3)) continue;
            const vec3 raised = crt_lift(&bsdf, toFloat(w));
            CHECK(raised.z >= 0);
            CHECK(length(toDouble(raised)) == Approx(1).margin(1e-6));
            CHECK(crt_cosine_before_lift(crt_below(&bsdf), dot3(raised, bsdf.ns), raised.z) ==
                  Approx(before).margin(2e-3 * std::sin(tilt) + 1e-5 / tilt));
            if (i % 2 == 1) CHECK(length(minus(toDouble(raised), w)) < 0.2);
        }
    }
}

TEST_CASE("BSDF: a sample's weight is the value over the density of its direction",
          "[kernel][bsdf][materials]") {
    Random random(72);
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            INFO(s.name << " from " << wo[2]);
            const bool has_singles = s.single(wo[2]) > 0;
            double worst_weight = 0, worst_pdf = 0;
            std::uint64_t valid = 0, wrong_side = 0, wrong_delta = 0, wrong_single = 0;
            for (int i = 0; i < 20000; ++i) {
                const CrtScatter scatter = Bench::sample(bsdf, random.pair(), random.pair());
                if (!scatter.valid) continue;
                ++valid;
                const u32 side =
                    (scatter.wi.z > 0) == (wo[2] > 0) ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS;
                wrong_side += (bsdf.flags & side) == 0 || std::abs(length(toDouble(scatter.wi)) - 1) > 1e-6;
                const double pdf = crt_layered_pdf(&bsdf, scatter.wi);
                const vec4 value = crt_layered_eval(&bsdf, scatter.wi);
                if (isDelta(bsdf)) {
                    wrong_delta += scatter.pdf != 0 || pdf != 0 || max4(value) != 0 ||
                                   (scatter.hero_only && (bsdf.flags & CRT_BSDF_DISPERSIVE) == 0);
                    continue;
                }
                if (scatter.pdf == 0) {
                    wrong_single += !has_singles ||
                                    length(minus(toDouble(scatter.wi), {-wo[0], -wo[1], wo[2]})) > 1e-5;
                    continue;
                }
                worst_pdf = std::max(worst_pdf, std::abs(scatter.pdf / pdf - 1));
                // Of a refraction whose direction depends on the wavelength, some may have no part in it.
                for (u32 l = 0; l < 4; ++l)
                    worst_weight =
                        fartherFrom0(worst_weight, (lane(scatter.weight, l) * pdf - lane(value, l)) /
                                                       std::max<double>(lane(value, l), 1e-3 * max4(value)));
            }
            CHECK(valid > 5000);
            CHECK(wrong_side == 0);
            CHECK(wrong_delta == 0);
            CHECK(wrong_single == 0);
            CHECK(worst_pdf < 1e-3);
            CHECK(worst_weight < 1e-3);
        }
    }
}

TEST_CASE("BSDF: the way back is as bright as the way there", "[kernel][bsdf][materials]") {
    Random random(73);
    for (const Subject& s : subjects()) {
        if (!s.reciprocal) continue;
        const Bench bench(s.material);
        INFO(s.name);
        double worst = 0;
        std::uint64_t compared = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d wo = random.direction();
            if (std::abs(wo[2]) < 0.01) continue;
            const CrtBsdf there = bench.prepare(wo, true);
            if (isDelta(there)) {
                // Of deltas the weights, for the hero alone: crossing scales radiance by 1/η², and back by
                // η².
                CrtRandom2 u = random.pair();
                const CrtScatter first = Bench::sample(there, u, u, 1);
                if (!first.valid) continue;
                const CrtBsdf back = bench.prepare(toDouble(first.wi), true);
                for (u.x = 0.0005f; u.x < 1; u.x += 0.001f) {
                    const CrtScatter second = Bench::sample(back, u, u, 1);
                    if (!second.valid || length(minus(toDouble(second.wi), wo)) > 1e-3) continue;
                    const u32 l = Bench::kHero;
                    worst = std::max(worst, std::abs(lane(first.weight, l) * first.eta_square -
                                                     lane(second.weight, l) * second.eta_square));
                    ++compared;
                    break;
                }
                if (compared > 500) break;
                continue;
            }
            const Vec3d wi = random.direction();
            if (std::abs(wi[2]) < 0.01) continue;
            const CrtBsdf back = bench.prepare(wi);
            for (u32 l = 0; l < 4; ++l) {
                // The arriving light is compressed by the index on its side, squared.
                const double square = indexSquare(s.material, l);
                const double a = lane(crt_layered_eval(&there, unitFloat(wi)), l) / std::abs(wi[2]) *
                                 (wi[2] < 0 ? square : 1),
                             b = lane(crt_layered_eval(&back, unitFloat(wo)), l) / std::abs(wo[2]) *
                                 (wo[2] < 0 ? square : 1);
                if (a == 0 && b == 0) continue;
                // Fresnel's transmittance rises from the critical angle like a root, so that rounding is
                // 2.4e-4 of it there: next to nothing, but not relative to what little passes.
                const double least = s.material.type == MaterialType::RoughDielectric ? 0.1 : 0.01;
                worst = std::max(worst, std::abs(a - b) / std::max({a, b, least}));
                ++compared;
            }
        }
        CHECK(compared > 400);
        CHECK(worst < 2e-3);
    }
}

TEST_CASE("BSDF: in white light everything is as bright as its albedo says, and no brighter than 1",
          "[kernel][bsdf][materials]") {
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            INFO(s.name << " from " << wo[2]);
            const double expected = s.albedo(wo[2]);
            // By samples: of a refraction that depends on the wavelength, the hero stands for all four.
            double sampled = 0;
            const auto kept = [&](const vec3& wi) {  // of the hero's radiance, by refraction
                const double square = indexSquare(s.material, Bench::kHero);
                return (wi.z > 0) == (wo[2] > 0) ? 1 : wo[2] > 0 ? square : 1 / square;
            };
            overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
                const CrtScatter scatter = Bench::sample(bsdf, u, choice);
                if (scatter.valid)
                    sampled += lane(scatter.weight, Bench::kHero) * kept(scatter.wi) * share;
            });
            CHECK(sampled < 1 + 2e-3);
            CHECK(sampled == Approx(expected).margin(3e-3));
            if (isDelta(bsdf)) continue;
            const double integral = total(overCells([&](const Vec3d& w) {
                const vec3 wi = unitFloat(w);
                return lane(crt_layered_eval(&bsdf, wi), Bench::kHero) * kept(wi);
            }));
            CHECK(integral < 1 + 2e-3);  // by cells, as the next line
            CHECK(integral == Approx(expected - s.single(wo[2])).margin(2e-3));
        }
    }
}

TEST_CASE("BSDF: directions follow the wavelengths that the path carries", "[kernel][bsdf][materials]") {
    // Wavelengths that carry nothing are not looked for; each wavelength's mean does not depend on the
    // others.
    const Bench bench(roughGlass(1.9, 1.4, 0.4));
    const Vec3d wo = spherical(0.7, 0.3);
    std::array<double, 3> passed{};
    const vec4 carried[3] = {splat4(1), make_vec4(0.1f, 2, 0.5f, 1), make_vec4(0, 0, 4, 0)};
    for (std::size_t c = 0; c < 3; ++c) {
        const CrtBsdf bsdf = bench.prepare(wo, carried[c]);
        const auto density = overCells([&](const Vec3d& w) { return crt_layered_pdf(&bsdf, unitFloat(w)); });
        CHECK(total(density) < 1 + 1e-3);
        overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
            const CrtScatter scatter = Bench::sample(bsdf, u, choice);
            if (!scatter.valid || scatter.wi.z > 0) return;
            passed[c] += lane(scatter.weight, Bench::kHero) * share;
            if (c == 2) CHECK(lane(scatter.weight, Bench::kHero) < 1);
        });
    }
    CHECK(passed[0] == Approx(passed[2]).epsilon(5e-3));
    CHECK(passed[1] == Approx(passed[2]).epsilon(5e-3));
}

TEST_CASE("coats: the table agrees with quadrature over the normals, and is not above 1",
          "[kernel][bsdf][materials]") {
    for (const double eta : {1.1, 1.5, 2.5})
        for (const double roughness : {0.1, 0.3, 0.6, 1.0}) {
            for (const double cosine : {0.05, 0.3, 0.7, 1.0}) {
                INFO(eta << " " << roughness << " at " << cosine);
                CHECK(crt::coatAlbedo(cosine, eta, roughness * roughness) ==
                      Approx(crt::verify::microfacetShares(cosine, eta, roughness).reflected)
                          .margin(3e-4));
            }
            for (int i = 0; i <= 10; ++i)
                CHECK(crt::coatAlbedo(std::max(1e-4, i / 10.0), eta, roughness * roughness) <= 1);
        }
    // Of a smooth coat, what is sent back from below is diffuse light against glass from within.
    const Material polished = plastic(1, 0);
    CHECK(crt::coatOf(crt::coatsOf({&polished, nullptr}), polished).internal_reflectance ==
          Approx(0.5963457597).epsilon(1e-6));
}
