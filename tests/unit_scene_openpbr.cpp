// Scene YAML: the materials that openpbr becomes.
#include "captured_log.h"
#include "scene_texts.h"

#include "scene/light_units.h"
#include "scene/scene.h"

#include <cmath>

using namespace crt;
using namespace crt::test;

TEST_CASE("openpbr emits by its luminance, and mixes as a whole", "[scene_yaml]") {
    const Scene scene = parse("materials: {m: {type: openpbr, base_metalness: 0.5, emission_luminance: 500, "
                              "emission_color: {rgb: [0.25, 0.25, 0.25], space: linear}}, "
                              "dark: {type: openpbr, emission_color: {blackbody: 3000}}, "
                              "black: {type: openpbr, emission_luminance: 1, emission_color: 0}}\n");
    REQUIRE(scene.emissions.size() == 1);
    CHECK(photometric(scene.emissions[0].radiance) == Approx(125).epsilon(1e-4));
    CHECK_FALSE(scene.emissions[0].two_sided);
    REQUIRE(scene.materials.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) CHECK(scene.materials[i].emission == (i == 2 ? 0 : -1));
}

TEST_CASE("openpbr becomes crt's own materials, mixed", "[scene_yaml]") {
    const auto materials = [](const std::string& keys) {
        return parse("materials: {m: {type: openpbr, " + keys + "}}\n").materials;
    };
    // The defaults are the specification's.
    const std::vector<Material> plain = materials("base_metalness: 0");
    REQUIRE(plain.size() == 1);
    CHECK(plain[0].name == "m");
    CHECK(plain[0].type == MaterialType::Plastic);
    CHECK(plain[0].by_color);
    CHECK(plain[0].reflectance == constantSpectrum(0.8));
    CHECK(plain[0].eta[0] == Approx(1.5));
    CHECK(plain[0].roughness == 0.3);
    // Parts come first; the opacity is the whole's.
    const std::vector<Material> mixed = materials(
        "base_weight: 0.5, base_metalness: 0.25, transmission_weight: 0.75, specular_weight: 0.5, "
        "geometry_opacity: 0.4");
    REQUIRE(mixed.size() == 5);
    const Material& whole = mixed[4];
    CHECK(whole.name == "m");
    CHECK(whole.type == MaterialType::Mix);
    CHECK(whole.amount == 0.25);
    CHECK(whole.opacity == 0.4);
    const Material& metal = mixed[static_cast<std::size_t>(whole.parts[1])];
    CHECK(metal.type == MaterialType::RoughConductor);
    CHECK(metal.by_color);
    CHECK(metal.reflectance == constantSpectrum(0.4));
    CHECK(metal.weight == 0.5);
    CHECK(metal.opacity == 1);
    const Material& dielectric = mixed[static_cast<std::size_t>(whole.parts[0])];
    CHECK(dielectric.type == MaterialType::Mix);
    CHECK(dielectric.amount == 0.75);
    const Material& clear = mixed[static_cast<std::size_t>(dielectric.parts[1])];
    CHECK(clear.type == MaterialType::RoughDielectric);
    CHECK_FALSE(clear.absorption);
    const double n = clear.eta[0];
    CHECK((n - 1) * (n - 1) / ((n + 1) * (n + 1)) == Approx(0.02));
    CHECK(mixed[static_cast<std::size_t>(dielectric.parts[0])].eta[0] == n);
    CHECK(materials("base_diffuse_roughness: 0.5")[0].diffuse_roughness == 0.5);
    const Material clay = materials("specular_weight: 0, base_diffuse_roughness: 0.5")[0];
    CHECK(clay.type == MaterialType::Plastic);
    CHECK(clay.eta == constantSpectrum(1));
    CHECK(clay.diffuse_roughness == 0.5);
    CHECK_FALSE(clay.by_color);
    const Material plain_clay =
        parse("materials: {m: {type: diffuse, reflectance: 0.8, roughness: 0.5}}\n").materials[0];
    CHECK(plain_clay.type == clay.type);
    CHECK(plain_clay.diffuse_roughness == 0.5);
    // Fuzz lies on each of the parts.
    for (const Material& part : materials("base_metalness: 0.5, fuzz_weight: 0.25, fuzz_color: 0.75"))
        CHECK((part.fuzz == 0.25 && part.fuzz_roughness == 0.5 &&
               part.fuzz_color == constantSpectrum(0.75)));
    CHECK(materials("specular_weight: 0")[0].type == MaterialType::Diffuse);
    CHECK_FALSE(plain[0].clearcoat);
    CHECK(materials("transmission_weight: 1, specular_roughness: 0")[0].type == MaterialType::Dielectric);
    const Material wine = materials(
        "transmission_weight: 1, transmission_color: 0.5, transmission_depth: 3")[0];
    CHECK((*wine.absorption)[7] == Approx(std::log(2.0) / 3));
    // Abbe's number, between the Fraunhofer lines.
    const Material prism = materials("transmission_weight: 1, specular_roughness: 0, specular_ior: 1.7, "
                                     "transmission_dispersion_scale: 0.5")[0];
    const auto at = [&](double nm) {
        const double place = nm - 360;
        const auto i = static_cast<std::size_t>(place);
        return prism.eta[i] + (place - static_cast<double>(i)) * (prism.eta[i + 1] - prism.eta[i]);
    };
    CHECK(at(587.6) == Approx(1.7).epsilon(1e-6));
    CHECK((at(587.6) - 1) / (at(486.1) - at(656.3)) == Approx(40).epsilon(1e-4));
    const std::vector<Material> film = materials(
        "transmission_weight: 1, thin_film_weight: 0.5, thin_film_thickness: 0.25, thin_film_ior: 1.6");
    REQUIRE(film.size() == 3);
    CHECK(film[0].film_thickness_nm == 0);
    CHECK(film[1].film_thickness_nm == 250);
    CHECK(film[1].film_index == constantSpectrum(1.6));
}

// Fails when the shares of the two sides are exchanged, or a texture is on the wrong side.
TEST_CASE("openpbr's thin walls are sheets and panes", "[scene_yaml]") {
    const auto materials = [](const std::string& keys) {
        return parse("materials: {m: {type: openpbr, geometry_thin_walled: true, " + keys + "}}\n")
            .materials;
    };
    const Material leaf = materials(
        "subsurface_weight: 1, subsurface_color: 0.8, "
        "subsurface_scatter_anisotropy: 0.5")[0];
    CHECK(leaf.type == MaterialType::Plastic);
    CHECK(leaf.by_color);
    CHECK(leaf.eta[0] == Approx(1.5));
    CHECK(leaf.reflectance[0] == Approx(0.2));
    CHECK((*leaf.transmittance)[0] == Approx(0.6));
    CHECK_FALSE(materials("subsurface_weight: 1, subsurface_scatter_anisotropy: -1")[0].isTranslucent());
    const std::vector<Material> half = materials("subsurface_weight: 0.5, base_color: 0.3");
    REQUIRE(half.size() == 3);
    CHECK(half[0].reflectance == constantSpectrum(0.3));
    CHECK_FALSE(half[0].isTranslucent());
    CHECK(half[1].isTranslucent());
    const std::vector<Material> pictured = materials(
        "subsurface_weight: 1, subsurface_color: {checker: [0.2, 0.4]}, subsurface_scatter_anisotropy: 0.5");
    REQUIRE(pictured.size() == 3);
    CHECK(pictured[2].amount == 0.75);
    CHECK(pictured[0].reflectance_texture == 0);
    CHECK_FALSE(pictured[0].isTranslucent());
    CHECK(pictured[1].transmittance_texture == 0);
    CHECK(pictured[1].reflectance == constantSpectrum(0));
    const Material pane = materials(
        "transmission_weight: 1, specular_roughness: 0, transmission_color: 0.5, "
        "thin_film_weight: 1, thin_film_thickness: 0.3")[0];
    CHECK(pane.type == MaterialType::ThinDielectric);
    CHECK(*pane.tint == constantSpectrum(0.5));
    CHECK_FALSE(pane.absorption);
    CHECK(pane.film_thickness_nm == Approx(300));
}

// Fails when a sheet may make light, or a colour that is nearly one is refused.
TEST_CASE("a sheet sends on at most what it receives", "[scene_yaml]") {
    const auto sheet = [](const std::string& type, const std::string& keys) {
        return parse("materials: {m: {type: " + type + ", " + keys + "}}\n").materials[0];
    };
    const Material paper = sheet("translucent", "reflectance: 0.4, transmittance: 0.6");
    CHECK(paper.type == MaterialType::Plastic);
    CHECK(paper.eta == constantSpectrum(1));
    CHECK(*paper.transmittance == constantSpectrum(0.6));
    CHECK(paper.transmits());
    CHECK_FALSE(paper.isClear());
    CHECK(sheet("plastic", "reflectance: 0.4, transmittance: 0.6").eta == constantSpectrum(1.5));
    CHECK_FALSE(sheet("plastic", "reflectance: 0.4, transmittance: 0").isTranslucent());
    const auto refusedSheet = [](const std::string& keys) {
        return refused("materials: {m: {type: translucent, " + keys + "}}\n");
    };
    CHECK_THAT(refusedSheet("reflectance: 0.7, transmittance: 0.5"),
               Contains("scene.yaml:2:") && Contains("together 1.2 or more") && Contains("at most 1"));
    CHECK_THAT(refusedSheet("reflectance: 0.7"), Contains("'transmittance' is missing"));
    const CapturedLog log;
    (void)parseScene(
        "crt: 1\nmaterials: {m: {type: translucent, reflectance: {rgb: [0.9, 0.2, 0.2]}, "
        "transmittance: {rgb: [0.8, 0.2, 0.2]}}}\n",
        "scene.yaml", ".", {});
    CHECK_THAT(log.text(), Contains("lets less light through there"));
    CHECK_THAT(refused("materials:\n  a: {type: translucent, reflectance: 0.1, transmittance: 0.1}\n  b: "
                       "{type: two_sided, front: a, back: a}\n"),
               Contains("lets light through"));
}

TEST_CASE("openpbr's coat lies on each of its parts, which are others below it", "[scene_yaml]") {
    const auto materials = [](const std::string& keys) {
        return parse("materials: {m: {type: openpbr, " + keys + "}}\n").materials;
    };
    const std::vector<Material> plain = materials("coat_weight: 1");
    REQUIRE(plain.size() == 1);
    REQUIRE(plain[0].clearcoat);
    CHECK(plain[0].clearcoat->ior == 1.6);
    CHECK(plain[0].clearcoat->roughness == 0);
    CHECK(plain[0].clearcoat->depth == constantSpectrum(0));
    CHECK(plain[0].clearcoat->darkening == 1);
    // Of the two indices the one above 1.
    CHECK(plain[0].type == MaterialType::Plastic);
    CHECK(plain[0].eta[0] == Approx(1.6 / 1.5));
    CHECK(materials("coat_weight: 1, specular_ior: 2, coat_ior: 1.25")[0].eta[0] == Approx(1.6));
    CHECK(materials("coat_weight: 1, coat_ior: 1.5")[0].type == MaterialType::Diffuse);
    CHECK(plain[0].roughness == 0.3);
    // Roughness below: diffuse, but for what the gloss reflects straight on.
    const double reflected = std::pow(0.1 / 3.1, 2);
    CHECK(plain[0].clearcoat->base_roughness == Approx(1 - 0.7 * reflected));
    CHECK(materials("coat_weight: 1, coat_ior: 1.5")[0].clearcoat->base_roughness == 1);
    const Material metal = materials("coat_weight: 1, base_metalness: 1, coat_roughness: 0.5, "
                                     "specular_roughness: 0.25, coat_color: 0.25, coat_darkening: 0.5")[0];
    CHECK(metal.type == MaterialType::RoughConductor);
    CHECK(metal.roughness == Approx(std::pow(std::pow(0.25, 4) + 2 * std::pow(0.5, 4), 0.25)));
    CHECK(metal.clearcoat->roughness == 0.5);
    CHECK(metal.clearcoat->base_roughness == 0.25);
    CHECK(metal.clearcoat->darkening == 0.5);
    CHECK(metal.clearcoat->depth.isConstant());
    CHECK(metal.clearcoat->depth[0] == Approx(std::log(2.0)));  // half of the way
    CHECK(materials("coat_weight: 1, base_metalness: 1, coat_roughness: 1")[0].roughness == 1);
    const Material red =
        materials("coat_weight: 1, coat_color: {rgb: [0.8, 0.2, 0.1], space: linear}")[0];
    CHECK_FALSE(red.clearcoat->depth.isConstant());
    CHECK(red.clearcoat->depth[100] > 2 * red.clearcoat->depth[280]);
    CHECK(materials("coat_weight: 1, coat_color: 0")[0].clearcoat->depth.max() < 1e3);
    // In part: the bare base and the coated one, each as it is.
    const std::vector<Material> mixed =
        materials("coat_weight: 0.25, base_metalness: 0.5, coat_roughness: 0.5, specular_roughness: 0");
    REQUIRE(mixed.size() == 7);
    const auto part = [&](const Material& of, std::size_t i) -> const Material& {
        return mixed[static_cast<std::size_t>(of.parts[i])];
    };
    const Material& whole = mixed[6];
    CHECK(whole.type == MaterialType::Mix);
    CHECK(whole.amount == 0.25);
    for (const std::size_t i : {0u, 1u}) {
        CHECK_FALSE(part(part(whole, 0), i).clearcoat);
        CHECK(part(part(whole, 0), i).roughness == 0);
        CHECK(part(part(whole, 1), i).clearcoat);
        CHECK(part(part(whole, 1), i).roughness == Approx(std::pow(0.125, 0.25)));
    }
    CHECK(part(part(whole, 0), 0).eta[0] == Approx(1.5));
    CHECK(part(part(whole, 1), 0).eta[0] == Approx(1.6 / 1.5));
    const std::vector<Material> worn = materials("coat_weight: {checker: [0, 1]}");
    REQUIRE(worn.size() == 3);
    CHECK(worn[2].amount_texture != kNoTexture);
    // Where a roughness depends on the place, each vertex adds that of the coat.
    const Material metal_by_place = materials(
        "coat_weight: 1, base_metalness: 1, coat_roughness: {checker: "
        "[0, 1]}, specular_roughness: 0.25")[0];
    CHECK(metal_by_place.clearcoat->roughness_texture != kNoTexture);
    CHECK(metal_by_place.clearcoat->roughens);
    CHECK(metal_by_place.roughness == 0.25);
    CHECK(metal_by_place.hasVaryingRoughness());
    const Material gloss_by_place = materials(
        "coat_weight: 1, coat_roughness: 0.5, specular_roughness: "
        "{checker: [0, 1]}")[0];
    CHECK(gloss_by_place.type == MaterialType::Plastic);
    CHECK(gloss_by_place.roughness_texture != kNoTexture);
    CHECK(gloss_by_place.clearcoat->roughens);
    CHECK(gloss_by_place.clearcoat->base_share == Approx(reflected));
    CHECK_FALSE(materials("coat_weight: 1, specular_roughness: {checker: [0, 1]}")[0].clearcoat->roughens);
    // Of a coat that is not there keys say nothing.
    const Material bare = materials("coat_roughness: 1, coat_color: 0, coat_ior: 3")[0];
    CHECK_FALSE(bare.clearcoat);
    CHECK(bare.roughness == 0.3);
    CHECK(bare.eta[0] == Approx(1.5));
}

TEST_CASE("openpbr refuses a roughness by place where its tables have one roughness",
          "[scene_yaml]") {
    for (const auto& [keys, why, instead] :
         {std::tuple{"coat_weight: 1, coat_roughness: {checker: [0, 1]}, base_metalness: 1, "
                     "specular_roughness_anisotropy: 0.5",
                     "a coat of uniform roughness", "give 'coat_roughness' a number"},
          std::tuple{"coat_weight: 1, coat_roughness: {checker: [0, 1]}, base_diffuse_roughness: 0.5",
                     "a gloss of uniform roughness", "leave 'base_diffuse_roughness' out"},
          std::tuple{"coat_weight: 1, coat_roughness: {checker: [0, 1]}, coat_roughness_anisotropy: 0.5",
                     "must be isotropic", "leave 'coat_roughness_anisotropy'"},
          std::tuple{"specular_roughness: {checker: [0, 1]}, base_diffuse_roughness: 0.5",
                     "a gloss of uniform roughness", "leave 'base_diffuse_roughness' out"}}) {
        INFO(keys);
        CHECK_THAT(refused(std::string("materials: {m: {type: openpbr, ") + keys + "}}\n"),
                   Contains(why) && Contains(instead));
    }
}
