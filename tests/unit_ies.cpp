// IES files: what is read, what is refused and where, and the flux of a distribution.
#include "catch.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "scene/ies_file.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>

using namespace crt;

namespace {

constexpr double kPi = std::numbers::pi;

const std::string kHead = "IESNA:LM-63-2002\n[TEST] 1\n";
const std::string kSizes = "1 1000 2 3 2 1 2 0 0 0\n0.5 0.25 40\n";
const std::string kGood = kHead + "TILT=NONE\n" + kSizes + "0 45 90\n0 90\n1 2 3\n4 5 6\n";

std::string with(const std::string& what, const std::string& instead) {
    std::string text = kGood;
    REQUIRE(text.find(what) != std::string::npos);
    return text.replace(text.find(what), what.size(), instead);
}

void refused(const std::string& text, int line, const std::string& words) {
    INFO(text);
    try {
        parseIes(text, "a.ies");
        FAIL("it is read");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Scene);
        CHECK_THAT(error.what(), Contains(words));
        CHECK(error.place().file == "a.ies");
        CHECK(error.place().line == line);
    }
}

}  // namespace

TEST_CASE("an IES file is what it says, with its factors and all round", "[ies]") {
    const IesProfile profile = parseIes(kGood, "a.ies");
    CHECK(profile.vertical_deg == std::vector<double>{0, 45, 90});
    CHECK(profile.horizontal_deg == std::vector<double>{0, 90, 180, 270, 360});
    const double f = 2 * 0.5 * 0.25;
    std::vector<double> candela;
    for (const double value : {1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6, 1, 2, 3}) candela.push_back(value * f);
    CHECK(profile.candela == candela);
    // However lines, commas and line ends lie, and whatever the labels say.
    for (const char* text :
         {"old file of 1986\r\nTILT=NONE\r\n1,1000,2,3,2,1,2,0,0,0,.5,.25,+40,0,45,90,0,90,1,2,3,4,5,6\r\n",
          "IESNA91\n[A] TILT is none\n  TILT=NONE \n1\n1000 2 3 2 1 2 0 0 0 0.5 2.5e-1 40 0 45 90\n\n\n0 90 "
          "1 2 3\t4 5 6",
          "IESNA:LM-63-1995\rTILT=INCLUDE\r1\r2\r0 90\r1 0.8\r1 1000 2 3 2 1 2 0 0 0 .5 .25 1\r0 45 90\r0 "
          "90\r1 2 3 4 5 6\r\n\n"}) {
        INFO(text);
        const IesProfile same = parseIes(text, "a.ies");
        CHECK(same.candela == profile.candela);
        CHECK(same.horizontal_deg == profile.horizontal_deg);
    }
    const IesProfile alone =
        parseIes(kHead + "TILT=NONE\n1 -1 1 2 1 1 1 0 0 0 1 1 1\n90 180\n0\n7 8\n", "a");
    CHECK(alone.horizontal_deg == std::vector<double>{0});
    CHECK(alone.candela == std::vector<double>{7, 8});
}

TEST_CASE("an IES file that is wrong is refused at its line", "[ies]") {
    refused("", 0, "the line 'TILT=' is missing");
    refused("a\nb\n", 2, "the line 'TILT=' is missing");
    refused(with("TILT=NONE", "TILT=lamp.tlt"), 3, "TILT=lamp.tlt is not read");
    refused(with("1 1000 2 3 2 1", "1 1000 2 3 2 3"), 4, "photometry of type A");
    refused(with("1 1000 2 3 2 1", "1 1000 2 3 2 2"), 4, "photometry of type B");
    refused(with("1 1000 2 3 2 1", "1 1000 2 3 2 7"), 4, "photometric type is 7");
    refused(with("1 1000 2 3 2 1", "1 1000 2 3e9 2 1"), 4, "whole number from 1 to 10000");
    refused(with("1 1000 2 3 2 1", "1 1000 2 3 2.5 1"), 4, "whole number from 1 to 10000");
    refused(with("1 1000 2 3 2 1", "1 1000 2 -3 2 1"), 4, "whole number from 1 to 10000");
    refused(with("1 1000 2 3 2 1", "1 1000 2 1 2 1"), 5, "one vertical angle");
    refused(with("1 1000 2 3 2 1", "1 1000 2 9000 2 1"), 5, "too short");
    refused(with("1 1000 2 3 2 1", "1 1000 0 3 2 1"), 5, "must be above 0");
    refused(with("0 45 90", "0 95 90"), 6, "vertical angles must increase, but 90 follows 95");
    refused(with("0 45 90", "0 45 100"), 6, "vertical angles go from 0 to 100");
    refused(with("0 45 90", "-90 0 90"), 6, "vertical angles go from -90 to 90");
    refused(with("\n0 90\n", "\n90 0\n"), 7, "horizontal angles must increase");
    refused(with("\n0 90\n", "\n0 70\n"), 7, "horizontal angles go from 0 to 70");
    refused(with("\n0 90\n", "\n90 270\n"), 7, "must have 180 among them");
    refused(with("4 5 6", "4 -5 6"), 9, "a candela value is -1.25");
    refused(with("4 5 6", "4 x5 6"), 9, "a number, found 'x5'");
    refused(with("4 5 6", "4 nan 6"), 9, "a number, found 'nan'");
    refused(with("4 5 6", "4 1e999 6"), 9, "a number, found '1e999'");
    refused(with("4 5 6", "4 5"), 9, "the file ends where a candela value should stand");
    refused(with("4 5 6", "4 5 6 7"), 9, "continues after the last candela value");
    // Ten thousand by ten thousand, as a bomb of a few bytes.
    refused(kHead + "TILT=NONE\n1 1 1 10000 10000 1 1 0 0 0 1 1 1\n0\n", 4, "too short");
}

TEST_CASE("the flux of an IES file is the integral of its interpolation", "[ies]") {
    CHECK(luminousFlux_lm({{0, 180}, {0}, {100, 100}}) == Approx(400 * kPi).epsilon(1e-12));
    CHECK(luminousFlux_lm({{0, 90}, {0, 360}, {100, 100, 100, 100}}) == Approx(200 * kPi).epsilon(1e-12));
    // By midpoints.
    const IesProfile profile{{0, 20, 90, 180}, {0, 100, 360}, {5, 9, 2, 1, 5, 1, 7, 1, 5, 9, 2, 1}};
    double sum = 0;
    constexpr int kSteps = 1800;
    for (int i = 0; i < kSteps; ++i) {
        const double theta = (i + 0.5) * 180 / kSteps;
        const std::size_t v = theta < 20 ? 0 : theta < 90 ? 1 : 2;
        const double t = (theta - profile.vertical_deg[v]) /
                         (profile.vertical_deg[v + 1] - profile.vertical_deg[v]);
        const auto at = [&](std::size_t h) {
            return (1 - t) * profile.candela[4 * h + v] + t * profile.candela[4 * h + v + 1];
        };
        // Over φ, trapezoids are exact.
        const double round = (100 * (at(0) + at(1)) + 260 * (at(1) + at(2))) / 2 * kPi / 180;
        sum += round * std::sin(theta * kPi / 180) * kPi / kSteps;
    }
    CHECK(luminousFlux_lm(profile) == Approx(sum).epsilon(1e-6));
}

TEST_CASE("IES lamps and beams of a scene, and what is wrong with them where it stands", "[ies]") {
    const TemporaryFolder folder;
    std::ofstream(folder / "good.ies") << kGood;
    std::ofstream(folder / "dark.ies") << with("1 2 3\n4 5 6", "0 0 0 0 0 0");
    std::ofstream(folder / "bad.ies") << with("4 5 6", "4 -5 6");
    const auto sceneOf = [&](const std::string& light) {
        return parseScene("crt: 1\nlights:\n  - {" + light + "}\n", "scene.yaml", folder.path());
    };
    const std::string ies = "type: ies, position: [0, 1, 0], file: good.ies";
    const PointLight lamp = sceneOf(ies + ", spectrum: 1").point_lights.at(0);
    CHECK(lamp.direction == Vec3d{0, -1, 0});
    CHECK(lamp.across == Vec3d{1, 0, 0});
    const double lumens = 683.002 * cieYIntegral();
    CHECK(lamp.strength == Approx(1.5 / lumens).epsilon(1e-9));  // The greatest, 6 times the factors.
    const auto strengthOf = [&](const std::string& more) {
        return sceneOf(ies + ", spectrum: 1" + more).point_lights.at(0).strength / lamp.strength;
    };
    CHECK(strengthOf(", scale: 3") == Approx(3));
    const double flux = luminousFlux_lm(*lamp.ies);
    CHECK(strengthOf(fmt::format(", luminous_flux_lm: {}", 2 * flux)) == Approx(2));
    CHECK(strengthOf(fmt::format(", power_w: {}", 470 * flux / lumens)) == Approx(1));
    // A lamp that shines along x turns its zero elsewhere.
    CHECK(sceneOf(ies + ", direction: [2, 0, 0]").point_lights.at(0).across == Vec3d{0, 0, 1});
    const PointLight slit = sceneOf("type: beam, position: [0, 1, 0], direction: [0, 0, 3], size: [2, 1], "
                                    "irradiance: 1")
                                .point_lights.at(0);
    CHECK(slit.radius == 0);
    CHECK(slit.width == 2);
    CHECK(std::abs(slit.across[0]) == 1);

    const auto wrong = [&](const std::string& light, const std::string& words) {
        INFO(light);
        CHECK_THROWS_WITH(sceneOf(light), Contains("scene.yaml:3:") && Contains(words));
    };
    wrong("type: ies, position: [0, 1, 0]", "'file' is missing");
    wrong("type: ies, position: [0, 1, 0], file: none.ies", "none.ies");
    wrong("type: ies, position: [0, 1, 0], file: dark.ies", "no light in any direction");
    wrong("type: ies, position: [0, 1, 0], file: bad.ies", "bad.ies:9: a candela value is -1.25");
    wrong(ies + ", c0: [0, 1, 0]", "no part across");
    wrong(ies + ", direction: [0, 0, 0]", "length 0");
    wrong(ies + ", scale: 1, power_w: 1", "scale");
    wrong(ies + ", scale: -1", "must be 0 or more");
    wrong(ies + ", spectrum: 0", "no visible light, which candelas measure");
    const std::string beam = "type: beam, position: [0, 1, 0], irradiance: 1";
    wrong(beam + ", direction: [0, -1, 0]", "radius or size");
    wrong(beam + ", direction: [0, -1, 0], radius: 1, size: [1, 1]", "radius");
    wrong(beam + ", direction: [0, -1, 0], radius: 0", "must be above 0");
    wrong(beam + ", direction: [0, -1, 0], size: [1, -1]", "must be above 0");
    wrong(beam + ", direction: [0, -1, 0], radius: 1, up: [0, 0, 1]", "a disk has no height");
    wrong(beam + ", direction: [0, -1, 0], size: [1, 1], up: [0, 2, 0]", "no part across");
    wrong(beam + ", target: [0, 1, 0], radius: 1", "where the light is");
}
