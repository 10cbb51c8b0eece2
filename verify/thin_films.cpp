// Group G, the part about thin films: Airy's sum of the kernel against matrices of layers, and conservation
// of energy.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"
#include "kernel/materials/bsdf.h"
#include "spectra/spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>

namespace crt::verify {
namespace {

/// Of white light the share in its luminance that `reflectance`, by nm, leaves.
double luminous(const std::function<double(double)>& reflectance) {
    const Spectrum& y = cieObserver()[1];
    double seen = 0, all = 0;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        seen += y[i] * reflectance(kWavelengthMin_nm + static_cast<double>(i));
        all += y[i];
    }
    return seen / all;
}

std::string floorBelow(double degrees, const std::string& material, bool glass,
                       const std::string& attributes = {}) {
    Stage stage(
        fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}}",
                    std::sin(degrees * kDegree), std::cos(degrees * kDegree)),
        kDirect);
    stage.set("environment", "{radiance: 1}");
    if (material.empty()) return stage.yaml();
    stage.material("it", material)
        .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]" + (attributes.empty() ? "" : ", " + attributes),
              "it");
    if (glass)
        stage.material("black", "{type: diffuse, reflectance: 0}")
            .quad("bottom", "[[-900,-1,-900],[-900,-1,900],[900,-1,900],[900,-1,-900]]", "black");
    return stage.yaml();
}

void airy(Context& context) {
    // The kernel's function, compiled here as C++, of all that a film can be.
    double worst = 0;
    std::string where;
    std::uint64_t asked = 0;
    for (const double thickness : {0.0, 5.0, 100.0, 400.0, 1000.0, 5000.0})
        for (const double cosine : {1.0, 0.8, 0.5, 0.2, 0.02})
            for (const double film : {0.8, 1.0, 1.33, 1.5, 2.4})
                for (const double wavelength : {360.0, 550.0, 830.0})
                    for (const std::complex<double> under :
                         {std::complex(1.0), std::complex(1.5), std::complex(1 / 1.5), std::complex(2.4),
                          std::complex(0.2, 3.0), std::complex(1.5, 7.0), std::complex(1.4, 1.6)}) {
                        const double kernel = static_cast<double>(kernel::crt_film_reflectance_lane(
                            static_cast<float>(cosine), static_cast<float>(film),
                            static_cast<float>(2 * thickness / wavelength), static_cast<float>(under.real()),
                            static_cast<float>(under.imag())));
                        const double off =
                            std::abs(kernel - filmReflectance(cosine, film, thickness, wavelength, under));
                        if (!(off <= worst)) {
                            worst = off;
                            where =
                                fmt::format("{} nm of index {} on {} + {}i at cosine {}, {} nm", thickness,
                                            film, under.real(), under.imag(), cosine, wavelength);
                        }
                        ++asked;
                    }
    context.absolute(fmt::format("{} films: the worst difference, {}", asked, where), worst, 0, 2e-4);
    // The films as a camera sees them.
    const auto ratio = [](const std::vector<Film>& f) { return luminance(f[0]) / luminance(f[1]); };
    const Effort effort{.samples = 1024, .most = 65536};
    for (const double degrees : {0.0, 60.0})
        for (const auto& [thickness, film] : {std::pair{120.0, 1.4}, std::pair{500.0, 2.2}}) {
            const double cosine = std::cos(degrees * kDegree);
            const std::string coating =
                fmt::format("thin_film: {{thickness_nm: {}, ior: {}}}", thickness, film);
            // `times`: what thickness a mistake would find. A pane has a second surface, without a film.
            const auto expected = [&](double times, std::complex<double> under, bool pane) {
                return luminous([&, thickness = thickness, film = film](double nm) {
                    if (pane)
                        return 1 - paneTransmittance(cosine, under.real(), film, times * thickness, nm);
                    return filmReflectance(cosine, film, times * thickness, nm, under);
                });
            };
            for (const auto& [type, under] : {std::pair{"conductor, eta: 0.2, k: 3", std::complex(0.2, 3.0)},
                                              std::pair{"dielectric, ior: 1.5", std::complex(1.5)},
                                              std::pair{"thin_dielectric, ior: 1.5", std::complex(1.5)}}) {
                const bool metal = *type == 'c', pane = *type == 't';
                context.estimate(
                    fmt::format("{} nm of index {} on {}, at {}°", thickness, film, type, degrees),
                    {floorBelow(degrees, fmt::format("{{type: {}, {}}}", type, coating), !metal),
                     floorBelow(degrees, "", false)},
                    ratio, expected(1, under, pane), metal ? 0.002 : 0.01, effort,
                    {{expected(0, under, pane), "there is no film"},
                     {expected(0.5, under, pane), "light crosses the film once between its sides"},
                     {expected(2, under, pane), "the way within the film counts twice"}});
            }
        }
    // relative_thickness, as a number and by the place: the same as a film that is thinner by this factor.
    for (const char* relative : {"0.25", "{checker: [0.25, 1], scale: 1e-3}"}) {
        const double cosine = std::cos(60 * kDegree);
        const auto expected = [&](double times) {
            return luminous([&](double nm) {
                return filmReflectance(cosine, 1.4, 480 * times, nm, std::complex(0.2, 3.0));
            });
        };
        context.estimate(
            fmt::format("480 nm, of which {}", relative),
            {floorBelow(60,
                        fmt::format("{{type: conductor, eta: 0.2, k: 3, thin_film: {{thickness_nm: 480, "
                                    "relative_thickness: {}, ior: 1.4}}}}",
                                    relative),
                        false, "uvs: [[0.2,0.2],[0.2,0.8],[0.8,0.8],[0.8,0.2]]"),
             floorBelow(60, "", false)},
            ratio, expected(0.25), 0.002, effort,
            {{expected(1), "relative_thickness is left out"}, {expected(0), "there is no film"}});
    }
}

void filmFurnace(Context& context) {
    // A film absorbs nothing: a clear body is invisible, whatever the film's thickness.
    const auto scene = [](const std::string& material, bool body) {
        Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 12}",
                    "{max_depth: 400, roulette: false}");
        stage.set("environment", "{radiance: 1}")
            .set("film", "{resolution: [8, 8]}")
            .material("it", material);
        if (body)
            stage.box("cube", {0, 0, 0}, {1, 1, 1}, "it");
        else
            stage.quad("it", "[[0,0,0.5],[1,0,0.5],[1,1,0.5],[0,1,0.5]]", "it");
        return stage.yaml();
    };
    const Effort effort{.samples = 64, .most = 16384};
    for (const auto& [thickness, film] : {std::pair{90.0, 1.33}, std::pair{700.0, 2.2}}) {
        const std::string coating = fmt::format("thin_film: {{thickness_nm: {}, ior: {}}}", thickness, film);
        const auto ask = [&, thickness = thickness, film = film](const char* material, bool body,
                                                                 double tolerance) {
            context.estimate(fmt::format("{}, {} nm of index {}", material, thickness, film),
                             scene(fmt::format("{{type: {}, {}}}", material, coating), body), meanRadiance,
                             1, tolerance, effort);
        };
        ask("thin_dielectric, ior: 1", false, 1e-3);
        ask("thin_dielectric, ior: 1.5", false, 1e-3);
        ask("dielectric, ior: 1.5", true, 3e-3);
        ask("rough_dielectric, ior: 1.5, roughness: 0.5", true, 3e-3);
        ask("conductor, eta: 1, k: 1e6", true, 1e-3);
        ask("rough_conductor, eta: 1, k: 1e6, roughness: 0.7", true, 3e-3);
    }
    if (!context.atLeast(Level::Merge)) return;
    context.estimate("dispersive glass of roughness .4, 300 nm of index 1.38",
                     scene("{type: rough_dielectric, ior: {glass: SF10}, roughness: 0.4, thin_film: "
                           "{thickness_nm: 300, ior: 1.38}}",
                           true),
                     meanRadiance, 1, 3e-3, effort);
}

}  // namespace

std::vector<Case> thinFilmCases() {
    constexpr std::uint64_t sky = CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_THIN_FILM;
    return {
        row("G19", "thin-film",
            "Films of 0 to 5000 nm and index .8 to 2.4 on glass and metals; seen on metal, glass and a pane "
            "at 0° and 60° in white light; a quarter of a film, by a number and by a texture",
            "the reflectance of the layers' characteristic matrices, s and p, in complex double",
            "Abelès (1950); Born and Wolf, 1.6", "2e-4; ± 0.2 %, ± 1 %", Level::Commit,
            sky | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC |
                CRT_FEATURE_TEXTURE,
            airy),
        row("G20", "film-furnace",
            "Films of 90 and 700 nm on panes, glass and perfect metal, smooth and rough, in a constant "
            "environment",
            "nothing is seen of them", "conservation of energy", "1e-3; 3e-3", Level::Commit,
            sky | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_DIELECTRIC |
                CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_TABLE,
            filmFurnace),
    };
}

}  // namespace crt::verify
