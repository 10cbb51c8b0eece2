// Group G: surfaces at the ends of their parameters.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"
#include "kernel/materials/bsdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace crt::verify {
namespace {

std::string numbers(const Vec3d& v) { return fmt::format("[{:.17g},{:.17g},{:.17g}]", v[0], v[1], v[2]); }

void lambertDirections(Context& context) {
    // A dome of 6 × 12 cells, equal in form factor, shines one cell at a time. The same seed gives the same
    // paths, so the images count how many of the same directions fall in each cell: χ² as it is in the
    // books.
    constexpr int rings = 6, sectors = 12;
    constexpr std::uint64_t samples = 1u << 13;
    std::vector<double> counts;
    double chi_squared = 0;
    const auto corner = [](double ring, double sector) {
        const double sine = std::sqrt(ring / rings), angle = 2 * kPi * sector / sectors;
        return Vec3d{sine * std::cos(angle), std::sqrt(1 - ring / rings), sine * std::sin(angle)};
    };
    const std::string empty = "{max_depth: 1, roulette: false, nee: false}";
    for (int ring = 0; ring < rings; ++ring)
        for (int sector = 0; sector < sectors; ++sector) {
            // Flat cells: chords of the rings, so that the form factor is a polygon's.
            const std::vector<Vec3d> cell{corner(ring, sector), corner(ring, sector + 1),
                                          corner(ring + 1, sector + 1), corner(ring + 1, sector)};
            const double share = polygonFormFactor({0, 0, 0}, {0, 1, 0}, cell);
            const std::string positions =
                ring == 0 ? fmt::format("[{},{},{}]", numbers(cell[0]), numbers(cell[2]), numbers(cell[3]))
                          : fmt::format("[{},{},{},{}]", numbers(cell[0]), numbers(cell[1]),
                                        numbers(cell[2]), numbers(cell[3]));
            const std::string scene =
                Stage("{position: [0.01, 0.02, 0], target: [0, 0, 0], fov: 0.001}", empty)
                    .set("sampler", "{type: independent}")
                    .material("white", "{type: diffuse, reflectance: 1}")
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .quad("floor", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "white")
                    .mesh("cell", positions, ring == 0 ? "[[0,1,2]]" : "[[0,1,2,3]]", "black",
                          "1, two_sided: true")
                    .yaml();
            const double n = 16.0 * static_cast<double>(samples);
            const double found = radiance(context.render(scene, {.samples = samples})) * n;
            chi_squared += (found - n * share) * (found - n * share) / (n * share);
            counts.push_back(found);
        }
    const double limit = stats::chiSquaredQuantile(1 - 1e-3, static_cast<double>(counts.size()) - 1);
    context.holds("χ² of directions over 72 cells of the dome", chi_squared < limit,
                  fmt::format("below {:.1f}, p = 1e-3", limit),
                  "directions are not distributed as the cosine: what is sampled and what is divided by are "
                  "two distributions",
                  fmt::format("χ² = {:.1f}", chi_squared));
}

void viewAngles(Context& context) {
    const auto scene = [](double degrees, double side) {
        const double x = 10 * std::sin(degrees * kDegree), y = 10 * side * std::cos(degrees * kDegree);
        return Stage(
                   fmt::format(
                       "{{position: [0, {:.17g}, {:.17g}], target: [0, 0, 0], up: [1, 0, 0], fov: 0.0001}}",
                       y, x),
                   kDirect)
            .material("white", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("floor", "[[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]]", "white")
            .quad("lamp", fmt::format("[[-0.5,{0},-0.5],[0.5,{0},-0.5],[0.5,{0},0.5],[-0.5,{0},0.5]]", side),
                  "black", "1, two_sided: true")
            .yaml();
    };
    for (const double side : {1.0, -1.0})
        for (const double degrees : {30.0, 60.0, 85.0, 89.9})
            context.estimate(
                fmt::format("seen from {}° off the normal, {}", degrees, side > 0 ? "above" : "below"),
                scene(degrees, side), meanRadiance, squareFormFactor(0, 0.5), 0.002,
                {.samples = 256, .most = 4096},
                {{0, "the back of a diffuse surface is black: crt's are two-sided"},
                 {squareFormFactor(0, 0.5) * std::cos(degrees * kDegree),
                  "radiance falls with the angle of view: Lambert's law has no cosine there"}});
}

void pdfIntegrates(Context& context) {
    // Around a point on a white floor shines everything: whatever technique finds it, the weights must add
    // up to one.
    const auto scene = [](bool nee) {
        return Stage("{position: [0.01, 0.02, 0], target: [0, 0, 0], fov: 0.001}",
                     fmt::format("{{max_depth: 1, roulette: false, nee: {}}}", nee))
            .material("white", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("floor", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "white")
            .mesh("room", "[[-2,0,-2],[2,0,-2],[-2,1,-2],[2,1,-2],[-2,0,2],[2,0,2],[-2,1,2],[2,1,2]]",
                  "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,2,6,4],[1,5,7,3]]", "black", "1, two_sided: true")
            .yaml();
    };
    context.estimate("with light sampling", scene(true), meanRadiance, 1, 0.001,
                     {.samples = 256, .most = 16384});
    context.estimate(
        "without", scene(false), meanRadiance, 1, 0.001, {.samples = 256, .most = 16384},
        {{1 / kPi, "the pdf of a diffuse surface does not integrate to 1: divided by pi twice?"}});
}

/// A film full of a flat surface under a constant environment, over the environment itself.
double whiteFurnace(Context& context, const std::string& material, double degrees = 0) {
    const std::string camera =
        fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}}",
                    std::sin(degrees * kDegree), std::cos(degrees * kDegree));
    const Film empty =
        context.render(Stage(camera).set("environment", "{radiance: 1}").yaml(), {.samples = 64});
    const Film film = context.render(Stage(camera, "{max_depth: 100, roulette: false}")
                                         .set("environment", "{radiance: 1}")
                                         .material("it", material)
                                         .quad("it", "[[-99,0,-99],[-99,0,99],[99,0,99],[99,0,-99]]", "it")
                                         .yaml(),
                                     {.samples = 64});
    return radiance(film) / radiance(empty);
}

void whiteFurnaces(Context& context) {
    for (const double degrees : {0.0, 60.0, 89.9}) {
        context.relative(fmt::format("diffuse, albedo 1, at {}°", degrees),
                         whiteFurnace(context, "{type: diffuse, reflectance: 1}", degrees), 1, 2e-6);
        context.relative(fmt::format("mirror, reflectance 1, at {}°", degrees),
                         whiteFurnace(context, "{type: mirror, reflectance: 1}", degrees), 1, 2e-6);
        // Complex Fresnel in double, unpolarised (Born and Wolf, 14.2), for n = 1, k = 6.
        const std::complex<double> eta(1, 6);
        const double c = std::cos(degrees * kDegree);
        const std::complex<double> t = std::sqrt(eta * eta - (1 - c * c));
        const double expected =
            (std::norm((c - t) / (c + t)) + std::norm((eta * eta * c - t) / (eta * eta * c + t))) / 2;
        context.relative(fmt::format("conductor of n = 1, k = 6 at {}°", degrees),
                         whiteFurnace(context, "{type: conductor, eta: 1, k: 6}", degrees), expected, 1e-5);
    }
}

void reciprocity(Context& context) {
    // One ray from outside to inside, and the same way back: f(i, o)/n_i² = f(o, i)/n_o². One decision by
    // one stratified number, right to 1/N.
    constexpr double n = 1.5;
    const auto scene = [](double degrees, double side) {
        const std::string camera =
            fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.0001}}",
                        std::sin(degrees * kDegree), side * std::cos(degrees * kDegree));
        const char* lamp = side > 0 ? "[[-900,-5,-900],[-900,-5,900],[900,-5,900],[900,-5,-900]]"
                                    : "[[-900,5,-900],[900,5,-900],[900,5,900],[-900,5,900]]";
        return Stage(camera, kDirect)
            .material("glass", "{type: dielectric, ior: 1.5}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("interface", "[[-99,0,-99],[-99,0,99],[99,0,99],[99,0,-99]]", "glass")
            .quad("lamp", lamp, "black", "1")
            .yaml();
    };
    const Render how{.samples = 1u << 14};
    for (const double degrees : {0.0, 20.0, 45.0, 70.0}) {
        const double refracted = std::asin(std::sin(degrees * kDegree) / n) / kDegree;
        const double in = radiance(context.render(scene(degrees, 1), how)),
                     out = radiance(context.render(scene(refracted, -1), how));
        context.relative(fmt::format("{}° outside, {:.4g}° inside: out over in", degrees, refracted),
                         out / in, n * n * n * n, 1e-4,
                         {{1, "radiance is not scaled by n² between the media"},
                          {n * n, "radiance is scaled by n² one way only"}});
    }
}

void indices(Context& context) {
    const auto scene = [](const std::string& ior, int depth) {
        Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 15}",
                    fmt::format("{{max_depth: {}, roulette: false}}", depth));
        stage.set("environment", "{radiance: 1}").set("film", "{resolution: [8, 8]}");
        if (!ior.empty())
            stage.material("glass", fmt::format("{{type: dielectric, ior: {}}}", ior))
                .box("cube", {0, 0, 0}, {1, 1, 1}, "glass");
        return stage.yaml();
    };
    const Render how{.samples = 64};
    const Film empty = context.render(scene("", 1), how);
    const Film one = context.render(scene("1", 8), how);
    context.sameBits("n = 1, and the empty scene", one, empty,
                     "an index of 1 is a surface that bends or loses light");
    for (const char* ior : {"1.0000001", "1.001", "1.5", "2.4", "100", "1000"}) {
        const Film film = context.render(scene(ior, 200000), how);
        context.relative(fmt::format("n = {}: a clear cube, the worst pixel", ior), worstRatio(film, empty),
                         1, 2e-4);
    }
}

void extremeNumbers(Context& context) {
    // The numbers that a sampler can give at the ends of its range, through every sampling routine of the
    // kernels (compiled here as C++).
    using namespace kernel;
    constexpr std::uint32_t words[] = {0u,          1u,          255u,        256u,        511u,       512u,
                                       0x7fffffffu, 0x80000000u, 0xfffffe00u, 0xfffffeffu, 0xffffffffu};
    double least = 1, most = 0;
    std::uint64_t bad = 0, asked = 0;
    const vec3 normal = make_vec3(0.0f, 0.0f, 1.0f);
    for (const std::uint32_t a : words)
        for (const std::uint32_t b : words) {
            CrtRandom2 u;
            u.x = crt_unit(a);
            u.y = crt_unit(b);
            least = std::min<double>(least, u.x);
            most = std::max<double>(most, u.x);
            const auto finite = [](vec3 v) {
                return std::isfinite(V3X(v)) && std::isfinite(V3Y(v)) && std::isfinite(V3Z(v));
            };
            const CrtScatter diffuse = crt_sample_diffuse(splat4(1.0f), normal, normal, u);
            // Valid with a pdf above 0, or rejected; never a direction that is none.
            bad += finite(diffuse.wi) && (!diffuse.valid || diffuse.pdf > 0.0f) ? 0 : 1;
            for (const float cosine : {1.0f, 0.5f, 1e-3f, 1e-7f})
                for (const float eta : {1.0f, 1.0000001f, 1.5f, 1 / 1.5f, 100.0f}) {
                    const vec3 wo = make_vec3(std::sqrt(1 - cosine * cosine), 0.0f, cosine);
                    const CrtScatter glass = crt_sample_dielectric(
                        splat4(eta), wo, normal, make_vec4(1.0f, 0.0f, 0.0f, 0.0f), 0, 0, u.x);
                    bad += !glass.valid || (finite(glass.wi) && std::isfinite(V4X(glass.weight))) ? 0 : 1;
                    ++asked;
                }
            ++asked;
        }
    context.relative("scatterings that are neither finite nor rejected", static_cast<double>(bad), 0, 0,
                     {{static_cast<double>(bad), "a warp degenerates at the end of its range"}});
    context.holds("random numbers are above 0 and below 1", least > 0 && most < 1, "(0, 1)",
                  "0 or 1 is where warps degenerate",
                  fmt::format("{:.9g} to 1 − {:.3g}, {} scatterings", least, 1 - most, asked));
}

void wordsToNumbers(Context& context) {
    // float(0xffffffff)·2⁻³² is 1.0f: the conversion must not round up.
    context.holds("the largest word", kernel::crt_unit(0xffffffffu) < 1.0f, "below 1",
                  "the largest random number rounds up to 1",
                  fmt::format("1 − {:.3g}", 1 - static_cast<double>(kernel::crt_unit(0xffffffffu))));
    context.holds("the smallest word", kernel::crt_unit(0u) > 0.0f, "above 0",
                  "the smallest random number is 0",
                  fmt::format("{:.3g}", static_cast<double>(kernel::crt_unit(0u))));
    // All cells alike: the mean is ½ and the variance 1/12.
    double sum = 0, squares = 0;
    constexpr std::uint32_t cells = 1u << 23;
    for (std::uint32_t i = 0; i < cells; ++i) {
        const double u = kernel::crt_unit(i << 9);
        sum += u;
        squares += u * u;
    }
    context.relative("mean over all words", sum / cells, 0.5, 1e-9);
    context.relative("mean square over all words", squares / cells, 1.0 / 3, 1e-9);
}

void albedoRange(Context& context) {
    const auto scene = [](const char* albedo) {
        return Stage("{position: [0, 1, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 1}", kDirect)
            .set("environment", "{radiance: 1}")
            .material("it", fmt::format("{{type: diffuse, reflectance: {}}}", albedo))
            .quad("it", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "it")
            .yaml();
    };
    context.relative("albedo 0", radiance(context.render(scene("0"), {.samples = 64})), 0, 0);
    context.relative("albedo 1", whiteFurnace(context, "{type: diffuse, reflectance: 1}"), 1, 2e-6);
}

}  // namespace

std::vector<Case> scatteringCases() {
    constexpr std::uint64_t light = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT;
    constexpr std::uint64_t sky = CRT_FEATURE_ENVIRONMENT;
    return {
        row("G01", "cosine-law", "Scattered directions of a diffuse surface, counted in 72 cells of a dome",
            "shares by Lambert's formula", "Lambert's formula; χ²", "p > 1e-3", Level::Merge,
            light | CRT_FEATURE_INDEPENDENT, lambertDirections),
        row("G02", "pdf", "A white floor in a glowing room, with and without light sampling",
            "1: the weights of both techniques add up", "normalisation", "± 0.1 %", Level::Commit,
            light | CRT_FEATURE_NEE, pdfIntegrates),
        row("G03", "white-furnace",
            "A flat surface in a constant environment at 0°, 60° and 89.9°: diffuse, mirror, conductor",
            "1, 1, Fresnel's reflectance for n + ik",
            "conservation of energy; Fresnel's equations in complex double", "2e-6; 1e-5", Level::Commit,
            sky | CRT_FEATURE_DIFFUSE | CRT_FEATURE_CONDUCTOR, whiteFurnaces),
        row("G04", "reciprocity", "A ray into glass and the same way back, at four angles",
            "n⁴ between the two", "f(i,o)/nᵢ² = f(o,i)/nₒ²", "1e-4", Level::Commit,
            CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT, reciprocity),
        row("G07", "indices",
            "A clear cube of n = 1, 1 + 1e-7, 1.001, 1.5, 2.4, 100, 1000 in a constant environment",
            "it cannot be seen; for n = 1 to the bit", "conservation of radiance over n²",
            "2e-4 in every pixel; same bits", Level::Commit, sky | CRT_FEATURE_DIELECTRIC, indices),
        row("G08", "extreme-numbers",
            "Random numbers at the ends of their range in every scattering routine", "finite, or rejected",
            "a pdf of 0 becomes NaN (pbrt-v4 #313)", "none", Level::Commit, 0, extremeNumbers),
        row("G09", "below-one", "Words to numbers", "above 0, below 1, mean ½, mean square ⅓",
        "arithmetic",
            "1e-9", Level::Commit, 0, wordsToNumbers),
        row("G10", "albedo-range", "Albedo 0 and 1", "black; all of the light", "docs/scene.md",
            "exactly; 2e-6", Level::Commit, sky | CRT_FEATURE_DIFFUSE, albedoRange),
        row("G11", "view-angles", "A03 seen from 30° to 89.9° off the normal, from above and from below",
            "0.2394564705 always", "Lambert's law has no angle of view", "± 0.2 %", Level::Commit,
            light | CRT_FEATURE_NEE, viewAngles),
    };
}

}  // namespace crt::verify
