// The clear sky: its model against numbers that Mitsuba's implementation gives, its sun against closed
// forms, the image that it becomes against the model, and what is refused.
#include "base/temporary_folder.h"
#include "catch.h"
#include "compile/sky_texels.h"
#include "scene/clear_sky.h"
#include "scene/light_units.h"
#include "scene_texts.h"
#include "scoped_variable.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

using namespace crt;
using crt::test::parse;
using crt::test::refused;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

SkyValues allOf(double albedo) {
    SkyValues values;
    values.fill(albedo);
    return values;
}

/// Towards `zenith` and `azimuth`, which counts from the sun, in degrees: radiance at 440, 560 and 680 nm.
struct Seen {
    double zenith, azimuth;
    std::array<double, 3> radiance;
};

/// By an evaluation of the published data apart from crt, which agrees with the plugin `sunsky` of Mitsuba
/// 3.9.1 (scalar_spectral) to four digits: illuminances of level ground by the sky, and of a plane that
/// faces the sun.
struct Sky {
    double turbidity, albedo, elevation, sky_lx, sun_lx;
    std::vector<Seen> seen;
};
const std::vector<Sky> kSkies{
    {2.5,
     0.3,
     35,
     15349.5,
     81453.8,
     {{0, 0, {0.0727352, 0.02971807, 0.01216097}}, {80, 0, {0.3201779, 0.244082, 0.1429488}}}},
    {6,
     0.1,
     8,
     10368.2,
     21803,
     {{60, 180, {0.05581832, 0.04190088, 0.022296}}, {80, 0, {0.2619508, 0.710327, 0.8098441}}}},
    {3,
     0.3,
     60,
     18870,
     87894.1,
     {{60, 90, {0.1550869, 0.06902231, 0.03043373}}, {60, 180, {0.1447121, 0.06200661, 0.02591767}}}},
    {1,
     0,
     2,
     3998.61,
     13916.6,
     {{0, 0, {0.009864056, 0.007291242, 0.003737136}}, {60, 90, {0.02028473, 0.01822536, 0.009944219}}}},
    {10,
     1,
     45,
     62772.7,
     46516.1,
     {{80, 0, {0.589637, 0.6758419, 0.5896466}}, {60, 180, {0.1592415, 0.1099362, 0.07613754}}}},
};

/// Between the sun and such a direction.
double cosToSun(const Sky& sky, const Seen& seen) {
    const double sun = (90 - sky.elevation) * kDegree, z = seen.zenith * kDegree;
    return std::cos(z) * std::cos(sun) + std::sin(z) * std::sin(sun) * std::cos(seen.azimuth * kDegree);
}

ClearSky sceneSky(const Sky& sky, int rows = 64) {
    ClearSky made;
    made.turbidity = sky.turbidity;
    made.ground_albedo = allOf(sky.albedo);
    const double e = sky.elevation * kDegree;
    made.towards_sun = {std::cos(e), std::sin(e), 0};
    made.rows = rows;
    return made;
}

}  // namespace

// Fails when parameters are exchanged, when turbidity, albedo or elevation is not interpolated, or when the
// angles with the zenith and the sun change places.
TEST_CASE("the clear sky is that of its publication", "[sky]") {
    for (const Sky& sky : kSkies) {
        INFO("turbidity " << sky.turbidity << ", elevation " << sky.elevation);
        const ClearSkyModel model(sky.turbidity, allOf(sky.albedo), sky.elevation * kDegree);
        for (const Seen& seen : sky.seen) {
            const double cosine = std::min(cosToSun(sky, seen), 1.0);
            const SkyValues found =
                model.radiance(std::cos(seen.zenith * kDegree), std::acos(cosine), cosine);
            for (std::size_t i = 0; i < 3; ++i)
                CHECK(found[2 + 3 * i] == Approx(seen.radiance[i]).epsilon(1e-5));
        }
        CHECK(photometric(skySpectrum(model.horizontalIrradiance())) == Approx(sky.sky_lx).epsilon(2e-3));
        CHECK(model.radiance(-0.1, 1, std::cos(1.0)) == SkyValues{});
    }
}

// Fails when a ring has the area of another, or disks do not add up.
TEST_CASE("the disks of a sun have its irradiance, and are darker towards the limb", "[sky]") {
    for (const Sky& sky : kSkies) {
        const ClearSkyModel model(sky.turbidity, allOf(sky.albedo), sky.elevation * kDegree);
        for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{8}}) {
            SkyValues irradiance{}, inside{};
            double before = 0;
            for (const SunDisk& disk : model.sunDisks(count)) {
                CHECK(disk.diameter > before);
                before = disk.diameter;
                for (std::size_t k = 0; k < kSkyWavelengths; ++k) {
                    CHECK((disk.radiance[k] > 0 || inside[k] == 0));
                    inside[k] += disk.radiance[k];
                    irradiance[k] +=
                        disk.radiance[k] * sunProjectedSolidAngle_sr(kSkySunDiameter_deg * disk.diameter);
                }
            }
            CHECK(before == 1);
            CHECK(photometric(skySpectrum(irradiance)) == Approx(sky.sun_lx).epsilon(1e-4));
        }
    }
}

// Fails when the fit of a texel loses its luminance, or its colour.
TEST_CASE("the image of a clear sky has its luminance and its colours", "[sky]") {
    double worst = 0, sum = 0, spectral = 0;
    int texels_seen = 0;
    for (const Sky& sky : kSkies) {
        INFO("turbidity " << sky.turbidity << ", elevation " << sky.elevation);
        const ClearSky made = sceneSky(sky);
        const ClearSkyModel model = made.model();
        SkyValues mean = model.horizontalIrradiance();
        for (double& value : mean) value /= std::numbers::pi;
        const Spectrum unit = skySpectrum(mean);
        const EnvironmentTexels texels = skyTexels(made, unit);
        for (std::size_t row = 0; row < texels.height; row += 3)
            for (std::size_t column = 0; column < texels.width; column += 7) {
                const auto& texel = texels.texels[row * texels.width + column];
                // The mean of the four points of the texel.
                SkyValues wanted{};
                for (const double y : {0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287})
                    for (const double x : {0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287}) {
                        const double zenith = (static_cast<double>(row) + y) * std::numbers::pi / 64;
                        const double azimuth =
                            ((static_cast<double>(column) + x) / 64 - 1) * std::numbers::pi;
                        const Vec3d d{std::sin(zenith) * std::sin(azimuth), std::cos(zenith),
                                      -std::sin(zenith) * std::cos(azimuth)};
                        const double cosine = std::min(dot(d, made.towards_sun), 1.0);
                        const SkyValues part = model.radiance(d[1], std::acos(cosine), cosine);
                        for (std::size_t k = 0; k < kSkyWavelengths; ++k) wanted[k] += part[k] / 4;
                    }
                Spectrum found = sigmoidSpectrum({texel.c0, texel.c1, texel.c2});
                for (std::size_t i = 0; i < found.values.size(); ++i) found[i] *= texel.scale * unit[i];
                if (row >= texels.height / 2) {
                    CHECK(found.max() == 0);
                    continue;
                }
                const Vec3d xyz = spectrumToXyz(found), right = spectrumToXyz(skySpectrum(wanted));
                const double all = right[0] + right[1] + right[2];
                CHECK(xyz[1] == Approx(right[1]).epsilon(5e-4));
                for (const int c : {0, 2}) {
                    worst = std::max(worst, std::abs(xyz[c] - right[c]) / all);
                    sum += std::abs(xyz[c] - right[c]) / all / 2;
                }
                for (std::size_t k = 0; k < kSkyWavelengths; ++k)
                    spectral += std::abs(found[k * kSkyWavelengthStep_nm] / wanted[k] - 1) / kSkyWavelengths;
                ++texels_seen;
            }
    }
    CHECK(worst < 0.01);
    CHECK(sum / texels_seen < 0.002);
    CHECK(spectral / texels_seen < 0.03);
}

TEST_CASE("a clear sky of a scene brings its sun", "[sky][yaml]") {
    const std::string sky = "environment: {clear_sky: {direction: [-0.8, -0.6, 0]";
    const Scene scene = parse(sky + "}}\n");
    REQUIRE(scene.environment->clear_sky);
    CHECK(scene.environment->clear_sky->turbidity == 3);
    CHECK(scene.environment->light_sampling);
    CHECK(scene.point_lights.size() == 8);
    CHECK(parse(sky + ", sun_scale: 0}}\n").point_lights.empty());
    // Of another size, and as bright.
    const auto irradiance = [](const Scene& of) {
        double sum = 0;
        for (const PointLight& light : of.point_lights)
            sum += photometric(light.spectrum) * light.strength *
                   sunProjectedSolidAngle_sr(light.angular_diameter_deg);
        return sum;
    };
    CHECK(irradiance(parse(sky + ", sun_diameter_deg: 10}}\n")) == Approx(irradiance(scene)).epsilon(1e-3));
    CHECK(parse(sky + ", scale: 2}}\n").environment->radiance[100] ==
          Approx(2 * scene.environment->radiance[100]));
    CHECK_FALSE(parse(sky + ", scale: 0}}\n").environment->clear_sky);
    // The time of a day in hours, too.
    const std::string here =
        "environment: {clear_sky: {date: 2026-06-21, latitude_deg: 50, longitude_deg: 10, ";
    CHECK(parse(here + "time_h: 12.5}}\n").environment->clear_sky->towards_sun ==
          parse(here + "time: '12:30'}}\n").environment->clear_sky->towards_sun);
    CHECK_THAT(refused(here + "time_h: 1}}\n"), Contains("degrees below the horizon"));
    CHECK_THAT(refused(here + "time_h: 24}}\n"), Contains("time_h"));
    CHECK_THAT(refused(here + "time_h: 12, time: '12:00'}}\n"), Contains("exclude each other"));
    CHECK_THAT(refused(here + "}}\n"), Contains("needs a time of day"));
    CHECK_THAT(refused(sky + ", turbidity: 11}}\n"), Contains("must be 1 to 10"));
    CHECK_THAT(refused(sky + ", albedo: 1}}\n"), Contains("did you mean 'ground_albedo'?"));
    CHECK_THAT(refused(sky + "}, light_linking: []}\n"), Contains("no light linking"));
    CHECK_THAT(refused("environment: {sunsky: {}}\n"), Contains("'clear_sky'"));
    CHECK_THAT(refused(sky + ", rows: 33}}\n"), Contains("even"));
    CHECK_THAT(refused(sky + ", sun_scale: 1e30}}\n"), Contains("radiance goes up to"));
    CHECK_THAT(refused("environment: {clear_sky: {direction: [0, 1, 0]}}\n"), Contains("below the horizon"));
    CHECK_THAT(refused(sky + "}, sky: {type: 12}}\n"), Contains("exclude each other"));
}
