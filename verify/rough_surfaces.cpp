// Group G, the part about metals and glass whose microfacets are rough, or hardly so.
#include "verify/context.h"
#include "verify/floors.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

void roughFurnace(Context& context) {
    const auto camera = [](double degrees, double distance) {
        return fmt::format(
            "{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}}",
            distance * std::sin(degrees * kDegree), distance * std::cos(degrees * kDegree));
    };
    const auto floor = [&](double degrees, double distance, const char* integrator, double n, double k,
                           double roughness) {
        return Stage(camera(degrees, distance), integrator)
            .material("it", fmt::format("{{type: rough_conductor, eta: {:g}, k: {:g}, roughness: {:g}}}", n,
                                        k, roughness))
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it");
    };
    const auto mistakes = [](double once, double squared) {
        return std::vector<Mistake>{{once, "what the microfacets lose is not given back"},
                                    {squared, "the width of GGX is the roughness, not its square"}};
    };
    const Render how{.samples = 1u << 12};
    // A perfect metal loses nothing; other metals lose what Fresnel's equations give for one and more
    // rounds.
    for (const auto& [n, k] : {std::pair{1.0, 1e6}, std::pair{0.2, 3.0}})
        for (const double roughness : {0.0, 0.1, 0.3, 0.5, 0.7, 1.0})
            for (const double degrees : {0.0, 60.0, 85.0, 89.0}) {
                const double cosine = std::cos(degrees * kDegree);
                const double expected = k == 1e6 ? 1 : roughConductorAlbedo(cosine, n, k, roughness);
                const auto wrong = mistakes(microfacetAlbedo(cosine, n, k, roughness),
                                            roughConductorAlbedo(cosine, n, k, std::sqrt(roughness)));
                context.relative(
                    fmt::format("roughness {}, n = {:g}, k = {:g}, seen from {}°", roughness, n, k,
                    degrees),
                    radiance(context.render(floor(degrees, 1, kDirect, n, k, roughness)
                                                .set("environment", "{radiance: 1}")
                                                .yaml(),
                                            how)),
                    expected, 2e-3, wrong);
            }
    // In a glowing room, light sampling and scattered rays share the work, or one does it alone.
    for (const char* integrator :
         {"{max_depth: 1, roulette: false}", "{max_depth: 1, roulette: false, nee: false}"})
        for (const double roughness : {0.5, 1.0}) {
            const double expected = roughConductorAlbedo(std::cos(30 * kDegree), 0.2, 3, roughness);
            context.estimate(
                fmt::format("in a glowing room, roughness {}, {}", roughness, integrator),
                floor(30, 0.5, integrator, 0.2, 3, roughness)
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .mesh(
                        "room", "[[-2,0,-2],[2,0,-2],[-2,1,-2],[2,1,-2],[-2,0,2],[2,0,2],[-2,1,2],[2,1,2]]",
                        "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,2,6,4],[1,5,7,3]]", "black", "1, two_sided: true")
                    .yaml(),
                meanRadiance, expected, 0.002, {.samples = 256, .most = 16384},
                mistakes(microfacetAlbedo(std::cos(30 * kDegree), 0.2, 3, roughness),
                         roughConductorAlbedo(std::cos(30 * kDegree), 0.2, 3, std::sqrt(roughness))));
        }
}

std::string roughMetal(double n, double k, double roughness) {
    return fmt::format("{{type: rough_conductor, eta: {:g}, k: {:g}, roughness: {:g}}}", n, k, roughness);
}

/// The distribution of the sharpest microfacets has the fewest digits: GGX's width is 1e-3 at the least.
void roughPeak(Context& context) {
    const Vec3d view = unit({0.4, 0.2, 0.7});
    for (const double roughness : {0.032, 0.04, 0.06, 0.1}) {
        for (const double degrees : {0.0, 60.0, 85.0, 89.0})
            context.relative(fmt::format("perfect metal of roughness {}, seen from {}°", roughness,
            degrees),
                             radiance(context.render(floorOf(roughMetal(1, 1e6, roughness), degrees),
                                                     {.samples = 1u << 12})),
                             1, 2e-3);
        // About the middle of the highlight, by slopes of the half vector in units of GGX's width.
        const double width = roughness * roughness;
        for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.7, 0.0}, {-0.3, 0.9}, {1.5, -1.5}}) {
            const Vec3d m = unit({x * width, y * width, 1});
            const Vec3d light = m * (2 * dot(m, view)) - view;
            const double expected = brushedReflection(view, light, roughness, 0);
            context.relative(
                fmt::format("a beam on metal of roughness {}, the half vector {:.1f} widths from the normal",
                            roughness, std::hypot(x, y)),
                inBeam(context, roughMetal(1, 1e6, roughness), view, light), expected, 0.01,
                {{brushedReflection(view, light, std::sqrt(roughness), 0),
                  "the width of GGX is the roughness, not its square"}});
        }
    }
}

void roughLimit(Context& context) {
    // Below 0.03 rough surfaces are taken for smooth ones; just above they hardly differ from these.
    for (const double roughness : {0.1, 0.05, 0.032, 0.02, 0.0})
        for (const double degrees : {0.0, 60.0, 85.0}) {
            const double cosine = std::cos(degrees * kDegree);
            const bool rough = roughness >= 0.03;
            context.relative(
                fmt::format("metal of roughness {}, seen from {}°", roughness, degrees),
                radiance(
                    context.render(floorOf(roughMetal(0.2, 3, roughness), degrees), {.samples = 1u << 12})),
                rough ? roughConductorAlbedo(cosine, 0.2, 3, roughness) : fresnelConductor(cosine, 0.2, 3),
                2e-3);
            if (roughness != 0.032 && roughness != 0.02 && !context.atLeast(Level::Merge)) continue;
            // The light that glass over black sends back.
            const std::string glass =
                Stage(eyeAt({std::sin(degrees * kDegree), cosine, 0}, "[0, 0, 1]"), kDirect)
                    .material("it",
                              fmt::format("{{type: rough_dielectric, ior: 1.5, roughness: {}}}", roughness))
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
                    .quad("bottom", "[[-900,-1,-900],[-900,-1,900],[900,-1,900],[900,-1,-900]]", "black")
                    .set("environment", "{radiance: 1}")
                    .yaml();
            context.estimate(fmt::format("glass of roughness {}, seen from {}°", roughness, degrees), glass,
                             meanRadiance,
                             rough ? roughDielectricShares(cosine, 1.5, roughness).reflected
                                   : fresnelDielectric(cosine, 1.5),
                             0.01, {.samples = 256, .most = 65536});
        }
}

}  // namespace

std::vector<Case> roughSurfaceCases() {
    constexpr std::uint64_t light = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT;
    constexpr std::uint64_t sky = CRT_FEATURE_ENVIRONMENT;
    return {
        row("G05", "rough-peak",
            "Perfect metals of roughness 0.032 to 0.1, where microfacet distributions lose their precision: "
            "in light from everywhere at four angles, and in beams about the highlight",
            "1; D G₂ / (4 cos θ_o) with what is lost given back", "conservation of energy; Heitz (2014)",
            "± 0.2 %; ± 1 %", Level::Commit,
            sky | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_NEE |
                CRT_FEATURE_DIFFUSE,
            roughPeak),
        row("G06", "rough-limit",
            "Metal and glass whose roughness goes to 0: 0.1, 0.05, 0.032, 0.02, 0, at 0°, 60° and "
            "85° (on "
            "commits glass of 0.032 and 0.02)",
            "quadrature over the normals; below 0.03 Fresnel's reflectance",
            "Heitz (2014); Kulla and Conty (2017); Fresnel's equations; docs/scene.md", "± 0.2 %; ± 1 %",
            Level::Commit,
            sky | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_DIFFUSE,
            roughLimit),
        row("G12", "rough-furnace",
            "Metals of roughness 0, .1, .3, .5, .7 and 1 in a constant environment, at 0°, 60°, 85° and "
            "89°; and in a glowing room, with and without light sampling",
            "1 of a perfect metal; else the share of light that GGX scatters once, by quadrature in double, "
            "and of the rest what two and more reflections leave",
            "conservation of energy; Heitz (2014); Kulla and Conty (2017); Fresnel's equations in complex "
            "double",
            "2e-3", Level::Commit, sky | light | CRT_FEATURE_NEE | CRT_FEATURE_ROUGH_CONDUCTOR,
            roughFurnace),
    };
}

}  // namespace crt::verify
