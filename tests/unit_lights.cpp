// Lights without a surface: what their keys mean, in independent arithmetic, what is refused, and how the
// kernel samples them.
#include "base/log.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "kernel_test.h"
#include "scene/light_units.h"
#include "scene/solar_position.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <fstream>
#include <numbers>

using namespace kernel_test;
using crt::PointLight;
using crt::PointLightType;
using crt::Scene;
using crt::test::CapturedLog;

namespace {

constexpr double kPi = std::numbers::pi;

Scene parsed(const std::string& body) {
    const CapturedLog quiet;
    return crt::parseScene("crt: 1\n" + body, "scene.yaml", ".", {});
}
PointLight read(const std::string& light) { return parsed("lights: [" + light + "]\n").point_lights.at(0); }
std::string refused(const std::string& body) {
    try {
        parsed(body);
    } catch (const crt::Error& error) {
        CHECK(error.kind() == crt::ErrorKind::Scene);
        return error.what();
    }
    return "accepted: " + body;
}
std::string refusedLight(const std::string& light) { return refused("lights:\n  - " + light + "\n"); }

/// Luminance of a spectrum by separate sums.
double lumens(const crt::Spectrum& s) {
    double sum = 0;
    for (std::size_t i = 0; i < crt::kSpectrumSize; ++i) sum += s[i] * crt::cieObserver()[1][i];
    return 683.002 * sum;
}

}  // namespace

TEST_CASE("how bright a light is says one key, in its unit", "[lights]") {
    CHECK(crt::luminanceOfUnitY_cd_m2() == Approx(lumens(crt::constantSpectrum(1))));
    const PointLight spectral = read("{type: point, position: [1, 2, 3], radiant_intensity: 5}");
    CHECK(spectral.strength * spectral.spectrum[7] == Approx(5));
    CHECK(spectral.position == crt::Vec3d{1, 2, 3});

    const PointLight flux = read("{type: point, position: [0, 0, 0], luminous_flux_lm: 800}");
    CHECK(4 * kPi * flux.strength * lumens(flux.spectrum) == Approx(800).epsilon(1e-9));
    // Of the default, daylight.
    CHECK(flux.spectrum == crt::illuminantSpectrum("D65").value());

    const PointLight power = read("{type: point, position: [0, 0, 0], power_w: 60, spectrum: 2}");
    CHECK(4 * kPi * power.strength * 2 * 470 == Approx(60).epsilon(1e-12));

    const PointLight candela = read(
        "{type: spot, position: [0, 0, 0], direction: [0, -2, 0], luminous_intensity_cd: 100, "
        "spectrum: {blackbody: 3000}}");
    CHECK(candela.strength * lumens(candela.spectrum) == Approx(100).epsilon(1e-9));
    CHECK(candela.direction == crt::Vec3d{0, -1, 0});

    const PointLight lux = read("{type: directional, direction: [0, -1, 0], illuminance_lx: 1e5}");
    CHECK(lux.strength * lumens(lux.spectrum) == Approx(1e5).epsilon(1e-9));

    const PointLight sun = read("{type: sun, direction: [0, -1, 0], illuminance_lx: 1e5}");
    const double sine = std::sin(0.265 * kPi / 180);
    CHECK(kPi * sine * sine * sun.strength * lumens(sun.spectrum) == Approx(1e5).epsilon(1e-9));

    const PointLight aimed =
        read("{type: spot, position: [1, 1, 1], target: [1, 1, 4], power_w: 1, penumbra_deg: 30}");
    CHECK(aimed.direction == crt::Vec3d{0, 0, 1});
    // ∫ of Hermite's cubic of the cosine over the sphere, by sums.
    double integral = 0;
    constexpr int kSteps = 200000;
    const double edge = std::cos(kPi / 6);
    for (int i = 0; i < kSteps; ++i) {
        const double c = edge + (1 - edge) * (i + 0.5) / kSteps, t = (c - edge) / (1 - edge);
        integral += 2 * kPi * (1 - edge) / kSteps * t * t * (3 - 2 * t);
    }
    double watts = 0;
    for (std::size_t i = 0; i + 1 < crt::kSpectrumSize; ++i)
        watts += (aimed.spectrum[i] + aimed.spectrum[i + 1]) / 2;
    CHECK(aimed.strength * integral * watts == Approx(1).epsilon(1e-8));
    // The default of the penumbra gives way to a narrow cone.
    CHECK(read("{type: spot, position: [0, 0, 0], direction: [1, 0, 0], power_w: 1, cone_angle_deg: 2}")
              .penumbra_deg == 2);
}

TEST_CASE("what a light cannot be is refused at its place", "[lights]") {
    const std::string point = "{type: point, position: [0, 0, 0]";
    CHECK_THAT(refusedLight(point + "}"), Contains("needs radiant_intensity or power_w"));
    CHECK_THAT(refusedLight(point + ", power_w: 1, luminous_flux_lm: 1}"), Contains("exclude each other"));
    CHECK_THAT(refusedLight(point + ", radiant_intensity: 1, spectrum: 2}"), Contains("exclude each other"));
    CHECK_THAT(refusedLight(point + ", power_w: -1}"), Contains("must be 0 or more"));
    CHECK_THAT(refusedLight(point + ", power_w: .nan}"), Contains("NaN"));
    CHECK_THAT(refusedLight(point + ", radiant_intensity: 1e26}"), Contains("must be 0 to 1e+25"));
    CHECK_THAT(refusedLight("{type: point, power_w: 1}"), Contains("'position' is missing"));
    CHECK_THAT(refusedLight("{position: [0, 0, 0], power_w: 1}"), Contains("'type' is missing"));
    CHECK_THAT(refusedLight("{type: spott, power_w: 1}"), Contains("did you mean 'spot'?"));
    CHECK_THAT(refusedLight("{type: point, position: [0, 0, 0], illuminance_lx: 1}"),
               Contains("unknown key 'illuminance_lx'"));
    // No light that the eye sees, but lumens asked for.
    CHECK_THAT(refusedLight(point + ", luminous_flux_lm: 1, spectrum: 0}"),
               Contains("has no light that 'luminous_flux_lm' measures") && Contains("scene.yaml:3:"));
    const std::string spot = "{type: spot, position: [0, 1, 0], power_w: 1";
    CHECK_THAT(refusedLight(spot + "}"), Contains("needs direction or target"));
    CHECK_THAT(refusedLight(spot + ", direction: [0, 0, 0]}"), Contains("length 0"));
    CHECK_THAT(refusedLight(spot + ", target: [0, 1, 0]}"), Contains("the target is where the light is"));
    CHECK_THAT(refusedLight(spot + ", direction: [0, 1, 0], cone_angle_deg: 0.009}"),
               Contains("0.01"));
    CHECK_THAT(refusedLight(spot + ", direction: [0, 1, 0], cone_angle_deg: 20, penumbra_deg: 21}"),
               Contains("wider than the cone"));
    CHECK_THAT(refusedLight("{type: sun, direction: [0, -1, 0], radiance: 1, angular_diameter_deg: 0}"),
               Contains("must be"));
    for (const char* light : {"{type: point, position: [0, 0, 0], power_w: 1}",
                              "{type: spot, position: [0, 0, 0], direction: [1, 0, 0], power_w: 1}",
                              "{type: directional, direction: [1, 0, 0], irradiance: 1}"})
        CHECK_THAT(refused(fmt::format("integrator: {{nee: false}}\nlights:\n  - {}\n", light)),
                   Contains("only light sampling finds light 0") && Contains("scene.yaml:4:5"));
    // A sun is found by chance, too; a view of normals shows no light.
    parsed("integrator: {nee: false}\nlights: [{type: sun, direction: [0, -1, 0], radiance: 1}]\n");
    parsed("integrator: {nee: false, type: normals}\nlights: [" + point + ", power_w: 1}]\n");

    // Beyond single precision only when it is moved and scaled.
    const auto compiled = [](const std::string& light) {
        crt::compileScene(parsed("lights: [" + light +
                                 "]\nmaterials: {m: {type: diffuse, reflectance: 1}}\n"
                                 "objects: [{material: m, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], "
                                 "faces: [[0,1,2]]}}]\n"),
                          0);
    };
    CHECK_THROWS_WITH(compiled("{name: far, type: point, position: [1e18, 0, 0], power_w: 1}"),
                      Contains("the light 'far' is too far from the scene"));
    CHECK_THROWS_WITH(compiled(point + ", power_w: 1e36}"), Contains("is 1e+25"));
}

TEST_CASE("the sun stands where almanacs say", "[lights]") {
    // Meeus, Astronomical Algorithms (2nd ed.), example 25.a: its own method, to its last digit.
    const crt::SolarCoordinates meeus = crt::solarCoordinates({1992, 10, 13, 0});
    CHECK(meeus.right_ascension_deg == Approx(198.38083).margin(1e-5));
    CHECK(meeus.declination_deg == Approx(-7.78507).margin(1e-5));
    // The same by VSOP87, example 25.b: 13h 13m 31.4s, -7° 47' 06".
    CHECK(meeus.right_ascension_deg == Approx(198.378178).margin(0.01));
    CHECK(meeus.declination_deg == Approx(-7.783871).margin(0.01));
    // Reda and Andreas, Solar Position Algorithm (NREL/TP-560-34302, 2008), table A5.1: 17 October 2003,
    // 12:30:30 at UTC - 7 h, before refraction.
    const crt::SolarPosition golden =
        crt::solarPosition({2003, 10, 17, 12.5 + 30.0 / 3600 + 7}, 39.742476, -105.1786);
    CHECK(golden.elevation_deg == Approx(39.872046).margin(0.01));
    CHECK(golden.azimuth_deg == Approx(194.340241).margin(0.01));
    // Solstice and equinox of 2024 (Astronomical Almanac): 21 December 9:20, 20 March 3:06.
    CHECK(crt::solarCoordinates({2024, 12, 21, 9 + 20.0 / 60}).declination_deg ==
          Approx(-23.4385).margin(0.005));
    CHECK(crt::solarCoordinates({2024, 3, 20, 3 + 6.0 / 60}).declination_deg == Approx(0).margin(0.001));
    // South of the sun it stands in the north; hours may lie outside the day.
    const crt::SolarPosition south = crt::solarPosition({2024, 12, 21, 12}, -60, 0);
    CHECK(std::abs(std::remainder(south.azimuth_deg, 360)) < 1);
    CHECK(crt::solarPosition({2024, 12, 20, 36}, -60, 0).elevation_deg == Approx(south.elevation_deg));
    CHECK(crt::isDate(2024, 2, 29));
    CHECK_FALSE(crt::isDate(2023, 2, 29));
    CHECK_FALSE(crt::isDate(2100, 2, 29));
    CHECK_FALSE(crt::isDate(2024, 4, 31));
}

TEST_CASE("a sun by date, time and place", "[lights]") {
    const std::string golden =
        "{type: sun, radiance: 1, date: 2003-10-17, time: 12:30:30, utc_offset: -7, "
        "latitude_deg: 39.742476, longitude_deg: -105.1786";
    const double h = 39.872046 * kPi / 180, a = 194.340241 * kPi / 180;
    const auto is = [](const crt::Vec3d& d, const crt::Vec3d& expected) {
        for (std::size_t k = 0; k < 3; ++k) CHECK(d[k] == Approx(expected[k]).margin(3e-4));
    };
    // North is -z, east x.
    const crt::Vec3d towards{std::cos(h) * std::sin(a), std::sin(h), -std::cos(h) * std::cos(a)};
    is(read(golden + "}").direction, times(towards, -1));
    // Turned: up z, north y; east is x still.
    is(read(golden + ", up: [0, 0, 2], north: [0, 5, 1]}").direction,
       times({std::cos(h) * std::sin(a), std::cos(h) * std::cos(a), std::sin(h)}, -1));

    const auto with = [](const char* date, const char* time, const char* more) {
        return refusedLight(
            fmt::format("{{type: sun, radiance: 1, date: {}, time: {}, latitude_deg: 50, "
                        "longitude_deg: 10{}}}",
                        date, time, more));
    };
    CHECK_THAT(with("2026-06-21", "'00:00'", ""),
               Contains("degrees below the horizon") && Contains("utc_offset"));
    CHECK_THAT(with("2026-02-30", "12:00", ""), Contains("there is no 2026-02-30"));
    CHECK_THAT(with("26-2-3", "12:00", ""), Contains("is not a date") && Contains("2026-06-21"));
    CHECK_THAT(with("1876-06-21", "12:00", ""), Contains("1950 to 2050"));
    CHECK_THAT(with("2026-06-21", "24:00", ""), Contains("is not a time of day"));
    CHECK_THAT(with("2026-06-21", "12.5", ""), Contains("time"));
    CHECK_THAT(with("2026-06-21", "12:00", ", utc_offset: 15"), Contains("must be -12 to 14"));
    CHECK_THAT(with("2026-06-21", "12:00", ", north: [0, 1, 0]"), Contains("'north' is parallel to 'up'"));
    CHECK_THAT(with("2026-06-21", "12:00", ", up: [0, 0, 0]"), Contains("length 0"));
    CHECK_THAT(with("2026-06-21", "12:00", ", direction: [0, -1, 0]"), Contains("exclude each other"));
    CHECK_THAT(refusedLight("{type: sun, radiance: 1, date: 2026-06-21, time: 12:00}"),
               Contains("needs 'latitude_deg' and 'longitude_deg' too"));
    CHECK_THAT(refusedLight("{type: sun, radiance: 1}"), Contains("needs direction or date"));
}

TEST_CASE("lights that nothing can show are warned of", "[lights]") {
    const auto said = [](const std::string& material, const std::string& integrator) {
        const Scene scene = parsed("integrator: " + integrator + "\nmaterials: {m: " + material +
                                   "}\nobjects: [{material: m, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], "
                                   "faces: [[0,1,2]]}}]\n"
                                   "lights: [{type: point, position: [0, 0, 1], power_w: 1}]\n");
        const CapturedLog log;
        crt::compileScene(scene, 0);
        return log.text();
    };
    CHECK(said("{type: diffuse, reflectance: 1}", "{}").empty());
    CHECK_THAT(said("{type: mirror, reflectance: 1}", "{}"), Contains("nothing scatters their light"));
    CHECK_THAT(said("{type: diffuse, reflectance: 1}", "{max_depth: 0}"), Contains("max_depth: 0"));
}

TEST_CASE("lights of included files come first", "[lights]") {
    const crt::TemporaryFolder folder;
    std::ofstream(folder.path() + "/room.yaml")
        << "crt: 1\nlights: [{name: below, type: point, position: [0, 0, 0], power_w: 1}]\n";
    const Scene scene = crt::parseScene(
        "crt: 1\ninclude: room.yaml\nlights: [{name: own, type: sun, direction: [0, -1, 0], radiance: 1}]\n",
        "scene.yaml", folder.path(), {});
    REQUIRE(scene.point_lights.size() == 2);
    CHECK(scene.point_lights[0].name == "below");
    CHECK(scene.point_lights[1].name == "own");
}

TEST_CASE("directions of a sun are uniform in its cone, however narrow", "[lights][kernel]") {
    Random random(7);
    for (const double degrees : {0.0005, 0.265, 5.0, 45.0, 120.0}) {
        const double sine = std::sin(degrees / 2 * kPi / 180);
        const auto cone = static_cast<f32>(2 * sine * sine);
        std::vector<std::uint64_t> cells(64);
        for (int i = 0; i < 64000; ++i) {
            const crt::Vec3d axis = random.direction();
            const CrtFrame frame = crt_frame(unitFloat(axis));
            const vec3 d = crt_cone_direction(frame.n, cone, random.pair());
            CHECK(length3(d) == Approx(1).epsilon(3e-7));
            // In double, from the frame: directions of a narrow cone differ from its axis by little.
            const double x = dot(toDouble(d), toDouble(frame.s)), y = dot(toDouble(d), toDouble(frame.t));
            const double z = dot(toDouble(d), toDouble(frame.n));
            const double sin2 = x * x + y * y;
            const double share = (z > 0 ? sin2 / (1 + std::sqrt(1 - std::min(sin2, 1.0))) : 1 - z) / cone;
            if (degrees > 0.001) CHECK(share < 1.001);
            if (degrees > 0.001) {
                const auto ring = std::min(7, static_cast<int>(share * 8));
                const auto sector = std::min(7, static_cast<int>((std::atan2(y, x) / (2 * kPi) + 0.5) * 8));
                ++cells[static_cast<std::size_t>(8 * ring + sector)];
            }
        }
        INFO(degrees);
        if (degrees > 0.001) CHECK(std::abs(chiSquaredDeviate(cells)) < 4.4);
    }
}

TEST_CASE("1 - cos keeps its digits where it is small", "[lights][kernel]") {
    Random random(8);
    for (int i = 0; i < 100000; ++i) {
        const vec3 a = unitFloat(random.direction());
        const double angle = std::pow(10, random.uniform(-3, 0.4));
        const CrtFrame frame = crt_frame(a);
        const vec3 b =
            unitFloat(plus(times(toDouble(a), std::cos(angle)), times(toDouble(frame.s), std::sin(angle))));
        const crt::Vec3d d = minus(unit(toDouble(a)), unit(toDouble(b)));
        const double exact = dot(d, d) / 2;
        // Directions are unit to 6e-8, so their difference is known to that.
        CHECK(crt_one_minus_cos(a, b) == Approx(exact).epsilon(4e-7 / angle + 1e-6));
    }
}

TEST_CASE("lengths are scaled, and the light of a point is what it was", "[lights][kernel]") {
    // By any power of two the same bits; by others nearly the same.
    const auto sampled = [](double scale) {
        crt::Mesh mesh;
        mesh.positions = {{-scale, 0, -scale}, {-scale, 0, scale}, {scale, 0, scale}, {scale, 0, -scale}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        Scene scene = sceneOf(mesh);
        scene.materials.resize(1);
        scene.materials[0].reflectance = crt::constantSpectrum(1);
        scene.objects[0].material = 0;
        PointLight light;
        light.spectrum = crt::constantSpectrum(1);
        light.position = {0.25 * scale, 0.5 * scale, 0};
        light.strength = scale * scale;
        scene.point_lights = {light};
        const crt::CompiledScene compiled = crt::compileScene(scene, 0);
        const CrtContext ctx = contextOf(compiled);
        CrtSampler sampler{};
        return crt_point_light_sample(&ctx, 0, &sampler, 0, make_vec3(0, 0, 0)).irradiance;
    };
    const f32 one = sampled(1);
    CHECK(one == Approx(1 / (0.25 * 0.25 + 0.5 * 0.5)));
    CHECK(sampled(1024) == one);
    CHECK(sampled(std::ldexp(1.0, -30)) == one);
    CHECK(sampled(3e7) == Approx(one));
}
