// The unit of a scene's lengths: what of its light depends on it, in closed form, and files that do not
// agree.
#include "base/temporary_folder.h"
#include "scene/length_unit.h"
#include "scene_texts.h"

#include <fmt/format.h>

using namespace crt;
using namespace crt::test;

namespace {

PointLight lightIn(const char* unit, const std::string& keys) {
    return parse(fmt::format("unit: {}\nlights: [{{{}}}]\n", unit, keys)).point_lights.at(0);
}

/// Irradiance per unit of the spectrum, at the distance in scene units: what the kernel makes of a light.
double irradianceOf(const PointLight& light, double distance) {
    return light.strength / (distance * distance);
}

}  // namespace

TEST_CASE("light from a point falls off by metres, whatever the unit", "[unit]") {
    for (const char* amount :
         {"luminous_flux_lm: 800", "power_w: 5", "luminous_intensity_cd: 100", "radiant_intensity: 3"})
        for (const char* kind : {"type: point", "type: spot, direction: [0, -1, 0]"}) {
            const std::string keys = fmt::format("{}, position: [0, 0, 0], {}", kind, amount);
            const double in_metres = irradianceOf(lightIn("m", keys), 2.5);
            for (const LengthUnit& unit : kLengthUnits) {
                INFO(keys << " in " << unit.name);
                CHECK(irradianceOf(lightIn(unit.name, keys), 2.5 / unit.metres) ==
                      Approx(in_metres).epsilon(1e-12));
            }
        }
    // 800 lm make 800 / 4π cd, and at 2 m 15.92 lx.
    const PointLight bulb = lightIn("mm", "type: point, position: [0, 0, 0], luminous_flux_lm: 800");
    double luminous = 0;
    for (std::size_t i = 0; i < kSpectrumSize; ++i)
        luminous += 683.002 * bulb.spectrum[i] * cieObserver()[1][i];
    CHECK(luminous * irradianceOf(bulb, 2000) == Approx(15.915494309).epsilon(1e-9));
}

TEST_CASE("a beam's flux spreads over square metres, and its irradiance is one already", "[unit]") {
    const std::string beam = "type: beam, position: [0, 0, 0], direction: [0, -1, 0], radius: ";
    for (const char* amount : {"power_w: 2", "luminous_flux_lm: 2"})
        CHECK(lightIn("mm", beam + "500, " + amount).strength ==
              Approx(lightIn("m", beam + "0.5, " + amount).strength).epsilon(1e-12));
    for (const char* amount : {"irradiance: 2", "illuminance_lx: 2"})
        CHECK(lightIn("mm", beam + "500, " + amount).strength ==
              lightIn("m", beam + "0.5, " + amount).strength);
    for (const char* far : {"type: directional, direction: [0, -1, 0], illuminance_lx: 100",
                            "type: sun, direction: [0, -1, 0], illuminance_lx: 100"})
        CHECK(lightIn("km", far).strength == lightIn("m", far).strength);
}

TEST_CASE("lengths stay as they are written, and so do all bits without a unit", "[unit]") {
    const std::string body =
        "camera: {position: [0, 1000, -4000], target: [0, 0, 0]}\n"
        "lights: [{type: point, position: [0, 5, 0], luminous_flux_lm: 800}]\n";
    const Scene none = parse(body), metres = parse("unit: m\n" + body), small = parse("unit: mm\n" + body);
    CHECK_FALSE(none.metres_per_unit);
    CHECK(metres.point_lights[0].strength == none.point_lights[0].strength);
    CHECK(small.camera.position == none.camera.position);
    CHECK(small.point_lights[0].position == none.point_lights[0].position);
    CHECK(parse(body, {{"unit", "mm"}}).point_lights[0].strength == small.point_lights[0].strength);
    CHECK_THAT(refused("unit: inches\n"), Contains("did you mean 'inch'?"));
}

TEST_CASE("files that are read as one scene have one unit", "[unit][refused]") {
    const TemporaryFolder folder;
    const auto unitOf = [&](const std::string& text) {
        return parse(text, {}, folder.path()).metres_per_unit;
    };
    folder.write("mm.yaml", "crt: 1\nunit: mm\n");
    folder.write("cm.yaml", "crt: 1\nunit: cm\n");
    folder.write("none.yaml", "crt: 1\ntitle: none\n");
    CHECK(unitOf("include: mm.yaml\n") == 0.001);
    CHECK(unitOf("include: mm.yaml\nunit: mm\n") == 0.001);
    CHECK(unitOf("include: none.yaml\nunit: mm\n") == 0.001);
    for (const char* text : {"include: mm.yaml\nunit: m\n", "include: [mm.yaml, cm.yaml]\n"}) {
        const std::string said = refused(text, {}, folder.path());
        CHECK_THAT(said, Contains("mm.yaml:2:7") && Contains("must use the same unit"));
    }
}
