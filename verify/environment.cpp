// Group E, the part about environments that depend on the direction: images and skies.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "base/temporary_folder.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>

namespace crt::verify {
namespace {

constexpr std::uint64_t kEnvironmentNeeds = CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE | CRT_FEATURE_ENVIRONMENT |
                                 CRT_FEATURE_ENVIRONMENT_LIGHT | CRT_FEATURE_ENVIRONMENT_IMAGE;
constexpr const char* kAlone = "{max_depth: 1, roulette: false, mis: false}";

/// An image of grey values by row from the top and column.
using Grey = double (*)(int row, int column);

/// Writes a PFM, whose rows go from the bottom up; returns its name.
std::string imageFile(const TemporaryFolder& folder, int rows, Grey grey) {
    const std::string path = folder.path() + fmt::format("/around{}.pfm", rows);
    std::ofstream file(path, std::ios::binary);
    file << fmt::format("PF\n{} {}\n-1.0\n", 2 * rows, rows);
    for (int row = rows - 1; row >= 0; --row)
        for (int column = 0; column < 2 * rows; ++column) {
            const auto value = static_cast<float>(grey(row, column));
            const std::array<float, 3> rgb{value, value, value};
            std::array<char, sizeof rgb> bytes{};
            std::memcpy(bytes.data(), rgb.data(), sizeof rgb);
            file.write(bytes.data(), bytes.size());
        }
    return path;
}

Stage floorUnder(const std::string& environment, const std::string& integrator = kDirect) {
    return Stage("{position: [2, 2, 0.2], target: [0, 0, 0.2], fov: 0.001}", integrator)
        .set("environment", "{" + environment + "}")
        .material("white", "{type: diffuse, reflectance: 1}")
        .quad("floor", "[[-4,0,-4.1],[-4,0,3.9],[4,0,3.9],[4,0,-4.1]]", "white");
}

/// A white sheet with the normal n.
Stage sheetFacing(const Vec3d& n, const std::string& environment, const std::string& integrator) {
    const Vec3d across = unit(cross(std::abs(n[1]) < 0.5 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, n)),
                along = cross(n, across);
    return Stage(eyeAt(n + across * 0.3, "[0.2, 0.4, 0.9]"), integrator)
        .set("environment", "{" + environment + "}")
        .material("white", "{type: diffuse, reflectance: 1}")
        .quad("sheet",
              fmt::format("[{}, {}, {}, {}]", point((across + along) * -1), point(across - along),
                          point(across + along), point(along - across)),
              "white");
}

/// The direction θ from the zenith, φ to the right of −z: what docs/scene.md calls the middle
/// of an image.
Vec3d aroundUs(double theta, double phi) {
    return {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)};
}

/// Of a texel over level ground, in units of its radiance: ∫ cos θ sin θ dθ dφ.
double groundIrradiance(int row, int rows) {
    const double upper = kPi * row / rows, lower = kPi * (row + 1) / rows;
    if (lower > kPi / 2 + 1e-9) return 0;
    return kPi / rows * (std::pow(std::sin(lower), 2) - std::pow(std::sin(upper), 2)) / 2;
}
double groundIrradiance(int rows, Grey grey) {
    double sum = 0;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < 2 * rows; ++column)
            sum += grey(row, column) * groundIrradiance(row, rows);
    return sum;
}

double even(int, int) { return 0.5; }
double single(int row, int column) { return row == 5 && column == 20 ? 300 : 0; }
double gradient(int row, int column) { return 0.1 + row * row * 0.02 + (column % 7) * 0.3; }
/// A disk of 1e4 times the rest.
double contrast(int row, int column) { return row == 9 && column == 3 ? 1e4 : 1; }

void images(Context& context) {
    const TemporaryFolder folder;
    // Pixel by pixel the constant environment of the same colour, seen and on a floor.
    const std::string same = imageFile(folder, 8, even);
    const auto both = [&](const std::string& camera, const std::string& integrator) {
        const auto of = [&](const std::string& environment) {
            return context.render(floorUnder(environment, integrator)
                                      .set("camera", camera)
                                      .set("film", "{resolution: [8, 8]}")
                                      .yaml(),
                                  {.samples = 16});
        };
        return worstRatio(of("image: " + same), of("radiance: {rgb: [0.5, 0.5, 0.5], space: linear}"));
    };
    context.relative("a grey image as that grey everywhere, seen",
                     both("{position: [0, 1, 0], target: [0, 3, 1], fov: 60}", "{max_depth: 0}"), 1, 5e-4);
    context.relative("and scattered by a floor, found by chance",
                     both("{position: [0, 1, 0], target: [0, 0, 1], fov: 60}",
                          "{max_depth: 1, roulette: false, nee: false}"),
                     1, 5e-4);

    struct Image {
        const char* what;
        int rows;
        Grey grey;
        double by_chance;
    };
    for (const Image& a : {Image{"a grey image", 8, even, 0.003},
                           {"a single bright texel", 16, single, 0},
                           {"a gradient", 32, gradient, 0.003},
                           {"a texel of 1e4 times the rest", 64, contrast, 0}}) {
        const std::string image = "image: " + imageFile(folder, a.rows, a.grey);
        // A pixel of {rgb: [v, v, v]} is v times D65, whose luminance is 1.
        const double expected = groundIrradiance(a.rows, a.grey) / kPi;
        const std::vector<Mistake> mistakes = {
            {2 * expected, "the image counts twice: by light sampling, and in full by rays that miss"},
            {expected / 2, "light sampling takes its share from rays that miss, and brings none itself"}};
        context.estimate(fmt::format("{}", a.what), floorUnder(image).yaml(), luminance, expected, 0.003,
                         {.samples = 256, .most = 65536}, mistakes);
        context.estimate(fmt::format("{}, light sampling alone", a.what), floorUnder(image, kAlone).yaml(),
                         luminance, expected, 0.003, {.samples = 256, .most = 65536}, mistakes);
        if (a.by_chance > 0)
            context.estimate(fmt::format("{}, by chance", a.what),
                             floorUnder(image + ", light_sampling: false").yaml(), luminance, expected,
                             a.by_chance, {.samples = 1024, .most = 65536}, mistakes);
    }

    // Level ground cannot tell azimuths apart. On a wall and on a slope a texel brings
    // ∫∫ (n·ω) sin θ dθ dφ.
    for (const auto& [what, normal] : {std::pair{"a wall", Vec3d{1, 0, 0}},
                                       {"a slope", unit({0.5, 0.6, -0.4})},
                                       {"an overhang", unit({0.4, -0.3, -0.8})}}) {
        const double column = 2 * kPi / 32, row = kPi / 16;
        const double expected = 300 / kPi *
                                rectangleIntegral(
                                    [n = normal](double theta, double phi) {
                                        return dot(n, aroundUs(theta, phi)) * std::sin(theta);
                                    },
                                    5 * row, 6 * row, 20 * column - kPi, 21 * column - kPi);
        for (const char* integrator : {kDirect, kAlone})
            context.estimate(
                fmt::format("a single bright texel on {}, {}", what, integrator),
                sheetFacing(normal, "image: " + imageFile(folder, 16, single), integrator).yaml(), luminance,
                expected, 0.003, {.samples = 256, .most = 65536},
                {{0, "the texel is sampled in another azimuth than it is seen in"}});
    }

    // Scale and rotation: the texel of row 5 and column 20 of 32 has its middle at azimuth
    // (20.5 / 32 - 1/2) 360 = 50.625 degrees to the right of -z, and 61.875 degrees from the zenith.
    const std::string one = imageFile(folder, 16, single);
    for (const double turn : {0.0, 90.0}) {
        const double azimuth = (50.625 - turn) * (kPi / 180), theta = 61.875 * (kPi / 180);
        const Film film = context.render(
            Stage(fmt::format("{{position: [0, 0, 0], target: [{}, {}, {}], fov: 5}}",
                              std::sin(azimuth) * std::sin(theta), std::cos(theta),
                              -std::cos(azimuth) * std::sin(theta)))
                .set("environment", fmt::format("{{image: {}, rotation_deg: {}, scale: 0.5}}", one, turn))
                .yaml(),
            {.samples = 256});
        context.relative(fmt::format("turned by {} degrees, half as bright, seen", turn), luminance(film),
                         150, 0.02, {{0, "the texel is elsewhere"}, {300, "the scale is lost"}});
    }
}

/// Luminance of the CIE general sky of types 3, 7 and 12 over the zenith's, by the text of the standard.
double skyLuminance(int type, double theta, double from_sun, double sun_theta) {
    const double a = type == 3 ? 1.1 : type == 7 ? 0 : -1, b = type == 3 ? -0.8 : type == 7 ? -1 : -0.32;
    const double c = type == 3   ? 0
                     : type == 7 ? 5
                                 : 10,
                 d = type == 3   ? -1
                     : type == 7 ? -2.5
                                 : -3,
                 e = type == 3   ? 0
                     : type == 7 ? 0.30
                                 : 0.45;
    const auto f = [&](double x) {
        return 1 + c * (std::exp(d * x) - std::exp(d * kPi / 2)) + e * std::cos(x) * std::cos(x);
    };
    const auto phi = [&](double z) { return 1 + a * std::exp(b / std::cos(z)); };
    return f(from_sun) * phi(theta) / (f(sun_theta) * phi(0));
}

void skies(Context& context) {
    // Y of the film is over ∫ȳ dλ = 106.857 nm (CIE 1931, by nanometres).
    const double lumens = 683.002 * 106.857;
    constexpr double kSunTheta = 40 * (kPi / 180);
    const std::string sun =
        fmt::format("direction: [{:.17g}, {:.17g}, 0]", -std::sin(kSunTheta), -std::cos(kSunTheta));
    const auto sky = [&](int type, const std::string& amount) {
        return floorUnder(fmt::format("sky: {{type: {}, {}, {}}}", type, amount, sun)).yaml();
    };
    context.estimate("type 5, uniform: E = pi L", sky(5, "zenith_luminance_cd_m2: 1000"), luminance,
                     1000 / lumens, 0.003, {.samples = 256, .most = 16384});
    for (const int type : {3, 7, 12}) {
        const double horizontal = rectangleIntegral(
            [&](double theta, double phi) {
                const double towards_sun = std::sin(theta) * std::sin(kSunTheta) * std::cos(phi) +
                                           std::cos(theta) * std::cos(kSunTheta);
                return skyLuminance(type, theta, std::acos(std::min(towards_sun, 1.0)), kSunTheta) *
                       std::cos(theta) * std::sin(theta);
            },
            0, kPi / 2 - 1e-12, 0, 2 * kPi, 16);
        context.estimate(fmt::format("type {} by its zenith", type),
                         sky(type, "zenith_luminance_cd_m2: 1000"), luminance,
                         1000 * horizontal / kPi / lumens, 0.003, {.samples = 256, .most = 65536});
        context.estimate(fmt::format("type {} by the ground's illuminance", type),
                         sky(type, "horizontal_illuminance_lx: 20000"), luminance, 20000 / kPi / lumens,
                         0.003, {.samples = 256, .most = 65536});
    }
    // The colour of another spectrum.
    context.estimate(
        "a sky of illuminant A",
        floorUnder("sky: {type: 12, horizontal_illuminance_lx: 20000, spectrum: {illuminant: A}, " + sun +
                   "}")
            .yaml(),
        luminance, 20000 / kPi / lumens, 0.003, {.samples = 256, .most = 65536});
    // Seen 30 degrees above the horizon, all around from the sun, which stands between two axes; texels are
    // 0.7 degrees high.
    constexpr double kTheta = 60 * kDegree, kSunPhi = 25 * kDegree;
    const auto towards = [](double theta, double from_x) {
        return Vec3d{std::sin(theta) * std::cos(from_x), std::cos(theta),
                     std::sin(theta) * std::sin(from_x)};
    };
    const auto luminanceAt = [&](double off) {
        const double cosine = dot(towards(kTheta, kSunPhi + off), towards(kSunTheta, kSunPhi));
        return 1000 * skyLuminance(12, kTheta, std::acos(cosine), kSunTheta);
    };
    for (const double degrees : {0.0, 60.0, 90.0, 180.0, 270.0, 300.0}) {
        const double off = degrees * kDegree;
        const Film film = context.render(
            Stage(fmt::format("{{position: [0, 0, 0], target: {}, fov: 1}}",
                              point(towards(kTheta, kSunPhi + off))))
                .set("environment",
                     fmt::format("{{sky: {{type: 12, zenith_luminance_cd_m2: 1000, direction: "
                                 "{}}}}}",
                                 point(towards(kSunTheta, kSunPhi) * -1)))
                .yaml(),
            {.samples = 1024});
        context.relative(fmt::format("type 12 seen {}° beside the sun", degrees), luminance(film) * lumens,
                         luminanceAt(off), 0.01,
                         {{luminanceAt(kPi - off), "the sun stands on the other side"},
                          {luminanceAt(off + 2 * kSunPhi), "the sun's azimuth is mirrored"}});
    }
}

/// A clear sky, and what it gives: by an evaluation of the published data apart from crt, which agrees with
/// the plugin `sunsky` of Mitsuba 3.9.1 (scalar_spectral) to four digits.
struct ClearDay {
    double turbidity, albedo, elevation;
    double sky_lx, sun_lx;  ///< Of level ground by the sky alone, and of a plane that faces the sun.
    /// 30 degrees above the horizon, 90 degrees beside the sun: luminance in cd/m², and chromaticity.
    double luminance, x, y;
};
constexpr ClearDay kClearDays[] = {{2.5, 0.3, 35, 15349.5, 81453.8, 4545.619, 0.2475, 0.2628},
                                   {6, 0.1, 8, 10368.2, 21803, 2853.68, 0.2854, 0.3111},
                                   {3, 0.3, 60, 18870, 87894.1, 5504.485, 0.2448, 0.2568}};

void clearSkies(Context& context) {
    const double lumens = 683.002 * 106.857;
    for (const ClearDay& day : kClearDays) {
        const double elevation = day.elevation * kDegree;
        const auto sky = [&](double sun_scale) {
            return fmt::format(
                "clear_sky: {{turbidity: {}, ground_albedo: {}, direction: [{:.17g}, {:.17g}, "
                "0], sun_scale: {}}}",
                day.turbidity, day.albedo, -std::cos(elevation), -std::sin(elevation), sun_scale);
        };
        const std::string what = fmt::format("turbidity {}, the sun at {}°", day.turbidity, day.elevation);
        const Effort effort{.samples = 256, .most = 65536};
        context.estimate(what + ": ground under the sky", floorUnder(sky(0)).yaml(), luminance,
                         day.sky_lx / kPi / lumens, 0.004, effort);
        context.estimate(
            what + ": ground in the sun", floorUnder(sky(1)).yaml(), luminance,
            (day.sky_lx + day.sun_lx * std::sin(elevation)) / kPi / lumens, 0.004, effort,
            {{(day.sky_lx + day.sun_lx) / kPi / lumens, "the sun's light falls straight down"}});
        const Film film =
            context.render(Stage(fmt::format("{{position: [0, 0, 0], target: [0, 0.5, {:.17g}], fov: 1}}",
                                             -std::sqrt(0.75)))
                               .set("environment", "{" + sky(1) + "}")
                               .yaml(),
                           {.samples = 4096});
        const Vec3d xyz = meanXyz(film);
        const double all = xyz[0] + xyz[1] + xyz[2];
        context.relative(what + ": seen beside the sun", xyz[1] * lumens, day.luminance, 0.02);
        context.absolute(what + ": its x", xyz[0] / all, day.x, 0.004);
        context.absolute(what + ": its y", xyz[1] / all, day.y, 0.004);
    }
}

}  // namespace

std::vector<Case> environmentCases() {
    return {
        row("E20", "environment-image",
            "Latitude-longitude images over a floor: grey, a single texel, a gradient, a contrast of 1e4; "
            "by light sampling, alone and by chance; a texel on a wall, a slope and an overhang; turned and "
            "scaled",
            "the constant environment; sums of each texel's irradiance; the texel where it belongs",
            "closed form of a texel over level ground; quadrature", "5e-4; ± 0.3 %; 2 %", Level::Commit,
            kEnvironmentNeeds, images),
        row("E21", "cie-sky",
            "CIE general skies over a floor, by zenith luminance and by illuminance; seen in six azimuths "
            "from "
            "the sun",
            "pi L for the uniform sky; the horizontal illuminance; the luminance there",
            "quadrature of ISO 15469:2004", "± 0.3 %; 1 %", Level::Commit,
            kEnvironmentNeeds | CRT_FEATURE_TABLE, skies),
        row("E28", "clear-sky",
            "Hosek and Wilkie's sky of three turbidities, albedos and elevations: a floor under the sky, "
            "and "
            "in the sun; the sky seen beside the sun",
            "the horizontal illuminance; with the sun's; luminance and chromaticity there",
            "another evaluation of the published data; Mitsuba 3.9.1", "± 0.4 %; 2 %, 0.004", Level::Commit,
            kEnvironmentNeeds | CRT_FEATURE_TABLE | CRT_FEATURE_POINT_LIGHT, clearSkies),
    };
}

}  // namespace crt::verify
