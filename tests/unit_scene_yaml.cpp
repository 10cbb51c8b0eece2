// Scene YAML: what good scenes become, and for every kind of mistake that the message names place, reason
// and remedy.
#include "base/log.h"
#include "captured_log.h"
#include "catch.h"
#include "film/film.h"
#include "film/resolve.h"
#include "base/temporary_folder.h"
#include "scene/aov.h"
#include "scene/yaml/scene_schema.h"
#include "scene/yaml/scene_yaml.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

using namespace crt;
using crt::test::CapturedLog;
using crt::TemporaryFolder;

namespace {

/// Keeps warnings off the terminal while it lives. They are counted all the same.
struct Quiet {
    Quiet() { setLogLevel(LogLevel::Off); }
    ~Quiet() { setLogLevel(LogLevel::Info); }
};

Scene parse(const std::string& body, const std::vector<SceneOverride>& overrides = {},
            const std::string& directory = ".") {
    const Quiet quiet;
    return parseScene("crt: 1\n" + body, "scene.yaml", directory, overrides);
}

/// The error of a text that must not be a scene.
Error refusal(const std::string& yaml, const std::vector<SceneOverride>& overrides = {},
              const std::string& directory = ".") {
    const Quiet quiet;
    try {
        parseScene(yaml, "scene.yaml", directory, overrides);
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        return e;
    }
    FAIL("accepted:\n" << yaml);
    throw;
}

/// What is said about a scene whose second line onwards is `body`.
std::string refused(const std::string& body, const std::vector<SceneOverride>& overrides = {},
                    const std::string& directory = ".") {
    return refusal("crt: 1\n" + body, overrides, directory).what();
}

/// What the log says about a scene that is accepted.
std::string saidOf(const std::string& body, const std::string& directory) {
    const CapturedLog log;
    parseScene("crt: 1\n" + body, "scene.yaml", directory, {});
    return log.text();
}

/// What is said about a reflectance.
std::string refusedReflectance(const std::string& spectrum) {
    return refused("materials:\n  m: {type: diffuse, reflectance: " + spectrum + "}\n");
}

std::string refusedOverride(const std::string& body, const std::string& argument) {
    return refused(body, {parseOverride(argument)});
}

std::size_t count(const std::string& text, const std::string& word) {
    std::size_t n = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
}

const std::string kTriangle = "{positions: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces: [[0, 1, 2]]}";
const std::string kGrey = "materials: {grey: {type: diffuse, reflectance: 0.5}}\n";

std::string meshScene(const std::string& object) {
    return kGrey + "objects:\n  - {material: grey, " + object + "}\n";
}

}  // namespace

// ---- Good scenes ----------------------------------------------------------------------------------------

TEST_CASE("the smallest scene is legal and has the defaults of core/scene/scene.h", "[scene_yaml]") {
    const Scene scene = parse("");
    const Camera camera;
    CHECK(scene.objects.empty());
    CHECK(scene.materials.empty());
    CHECK(scene.outputs.empty());
    CHECK_FALSE(scene.environment.has_value());
    CHECK(scene.camera.position == camera.position);
    CHECK(scene.camera.tan_half_width == camera.tan_half_width);
    CHECK(scene.camera.tan_half_height == camera.tan_half_height);
    CHECK(scene.film.width == FilmSettings{}.width);
    CHECK(scene.integrator.max_depth == IntegratorSettings{}.max_depth);
    CHECK(scene.sampler.samples == SamplerSettings{}.samples);
}

TEST_CASE("writing every default of the schema out changes nothing", "[scene_yaml]") {
    std::string text;
    int written = 0;
    for (const char* name : {"camera", "film", "integrator", "sampler"}) {
        text += std::string(name) + ":\n";
        for (const KeySchema& key : schemaSection(name).keys)
            if (!key.fallback.empty()) text += "  " + key.name + ": " + key.fallback + "\n", ++written;
    }
    for (const KeySchema& key : schemaSection("").keys)
        if (!key.fallback.empty()) text += key.name + ": " + key.fallback + "\n", ++written;
    CHECK(written == 29);

    const Scene a = parse(""), b = parse(text);
    CHECK(a.camera.position == b.camera.position);
    CHECK(a.camera.target == b.camera.target);
    CHECK(a.camera.up == b.camera.up);
    CHECK(b.camera.tan_half_width == Approx(a.camera.tan_half_width).epsilon(1e-12));
    CHECK(b.camera.tan_half_height == Approx(a.camera.tan_half_height).epsilon(1e-12));
    CHECK(a.camera.aperture_radius == b.camera.aperture_radius);
    CHECK(a.camera.focus_distance == b.camera.focus_distance);
    CHECK(a.film.width == b.film.width);
    CHECK(a.film.height == b.film.height);
    CHECK(a.film.crop == b.film.crop);
    CHECK(a.film.filter == b.film.filter);
    CHECK(a.film.filter_radius == b.film.filter_radius);
    CHECK(a.film.filter_sigma == b.film.filter_sigma);
    CHECK(a.film.color_space == b.film.color_space);
    CHECK(a.film.white_balance == b.film.white_balance);
    CHECK(a.film.exposure_ev == b.film.exposure_ev);
    CHECK(a.film.apply_to_float == b.film.apply_to_float);
    CHECK(a.integrator.type == b.integrator.type);
    CHECK(a.integrator.max_depth == b.integrator.max_depth);
    CHECK(a.integrator.roulette_depth == b.integrator.roulette_depth);
    CHECK(a.integrator.roulette == b.integrator.roulette);
    CHECK(a.integrator.nee == b.integrator.nee);
    CHECK(a.integrator.accelerator == b.integrator.accelerator);
    CHECK(a.sampler.type == b.sampler.type);
    CHECK(a.sampler.seed == b.sampler.seed);
    CHECK(a.sampler.samples == b.sampler.samples);
}

TEST_CASE("the choices of the schema are in the order of the enumerations", "[scene_yaml]") {
    // Of every choice of the schema what it shall become; a choice that is not here fails the test.
    const auto all = [](const std::string& section, const std::string& key, const auto& values, auto read) {
        const std::vector<std::string>& choices = schemaSection(section).find(key)->choices;
        INFO(section << "." << key);
        REQUIRE(choices.size() == values.size());
        for (std::size_t i = 0; i < choices.size(); ++i) {
            const auto found = values.find(choices[i]);
            INFO(choices[i]);
            REQUIRE(found != values.end());
            CHECK(read(choices[i]) == found->second);
        }
    };
    all("integrator", "type",
        std::map<std::string, IntegratorType>{{"path", IntegratorType::Path},
                                              {"normals", IntegratorType::Normals},
                                              {"aabb", IntegratorType::Aabb}},
        [](const std::string& name) { return parse("integrator: {type: " + name + "}").integrator.type; });
    all("integrator", "accelerator",
        std::map<std::string, Accelerator>{{"auto", Accelerator::Auto},
                                           {"bvh", Accelerator::Bvh},
                                           {"aabb", Accelerator::Aabb},
                                           {"none", Accelerator::None}},
        [](const std::string& name) {
            return parse("integrator: {accelerator: " + name + "}").integrator.accelerator;
        });
    all("sampler", "type",
        std::map<std::string, SamplerType>{{"sobol", SamplerType::Sobol},
                                           {"independent", SamplerType::Independent},
                                           {"xorshift", SamplerType::XorShift}},
        [](const std::string& name) { return parse("sampler: {type: " + name + "}").sampler.type; });
    all("film", "color_space",
        std::map<std::string, ColorSpace>{
            {"srgb", ColorSpace::LinearSrgb}, {"acescg", ColorSpace::AcesCg}, {"xyz", ColorSpace::Xyz}},
        [](const std::string& name) { return parse("film: {color_space: " + name + "}").film.color_space; });
    all("filter", "type",
        std::map<std::string, PixelFilter>{{"box", PixelFilter::Box},
                                           {"gaussian", PixelFilter::Gaussian},
                                           {"blackman-harris", PixelFilter::BlackmanHarris}},
        [](const std::string& name) { return parse("film: {filter: " + name + "}").film.filter; });
    all("output", "format",
        std::map<std::string, OutputFormat>{{"exr", OutputFormat::Exr},
                                            {"png", OutputFormat::Png},
                                            {"ppm", OutputFormat::Ppm},
                                            {"pfm", OutputFormat::Pfm}},
        [](const std::string& name) {
            return parse("outputs: [{file: a, format: " + name + "}]").outputs[0].format;
        });
    all("output", "aovs",
        std::map<std::string, std::uint32_t>{{"albedo", kAovAlbedo},
                                             {"normal", kAovNormal},
                                             {"depth", kAovDepth},
                                             {"primitive", kAovPrimitive},
                                             {"variance", kAovVariance},
                                             {"samples", kAovSamples},
                                             {"error", kAovError}},
        [](const std::string& name) {
            return parse("outputs: [{file: a.exr, aovs: [" + name + "]}]").outputs[0].aovs;
        });

    const Scene outputs =
        parse("outputs: [{file: a.exr}, {file: a.PNG}, {file: a, format: ppm}, {file: -, format: pfm}]");
    CHECK(outputs.outputs[0].format == OutputFormat::Exr);
    CHECK(outputs.outputs[1].format == OutputFormat::Png);
    CHECK(outputs.outputs[2].format == OutputFormat::Ppm);
    CHECK(outputs.outputs[3].format == OutputFormat::Pfm);
}

TEST_CASE("every AOV is written by its name in a scene, alone and together", "[scene_yaml]") {
    std::uint32_t together = 0;
    std::string list;
    for (const AovRow& row : kAovRows) {
        if (row.name.empty()) continue;
        INFO(row.name);
        const Output output =
            parse(fmt::format("outputs: [{{file: a.exr, aovs: [{}]}}]", row.name)).outputs[0];
        CHECK(output.aovs == row.aov);
        together |= row.aov;
        list += fmt::format("{}{}", list.empty() ? "" : ", ", row.name);

        // Read from the scene, resolved from a film that has what the scene asks for: the channels that the
        // row names, and no others.
        const std::uint32_t in_film = output.aovs & kAovsOfFirstHits;
        const Image image =
            resolveImage(Film({2, 1, channelsFor(in_film), in_film}), Development{}, output.aovs);
        std::vector<std::string> channels = {"R", "G", "B"};
        const std::vector<std::string> own = exrNames(row);
        CHECK_FALSE(own.empty());
        if (!row.integer) channels.insert(channels.end(), own.begin(), own.end());
        CHECK(image.channels == channels);
        CHECK(image.integer_channels == (row.integer ? own : std::vector<std::string>{}));
        CHECK(image.pixels.size() == 2 * image.channels.size());
        CHECK(image.integers.size() == 2 * image.integer_channels.size());
    }
    CHECK(parse("outputs: [{file: a.exr, aovs: [" + list + "]}]").outputs[0].aovs == together);
    CHECK(aovNamed("") == 0);
    CHECK(aovNamed("replicates") == 0);
}

TEST_CASE("the field of view is across the shorter side, or comes from the sensor", "[scene_yaml]") {
    const Scene wide = parse("camera: {fov: 90}\nfilm: {resolution: [200, 100]}");
    CHECK(wide.camera.tan_half_height == Approx(1));
    CHECK(wide.camera.tan_half_width == Approx(2));
    const Scene high = parse("film: {resolution: [100, 300]}\ncamera: {fov: 90}");
    CHECK(high.camera.tan_half_width == Approx(1));
    CHECK(high.camera.tan_half_height == Approx(3));
    CHECK(parse("film: {resolution: [200, 100]}").camera.tan_half_width == 2 * Camera{}.tan_half_width);
    const Scene lens =
        parse("camera: {focal_length: 35, sensor: [25, 25], aperture_radius: 2, focus_distance: 7}");
    CHECK(lens.camera.tan_half_width == Approx(25.0 / 70));
    CHECK(lens.camera.aperture_radius == 2);
    CHECK(lens.camera.focus_distance == 7);
}

TEST_CASE("film details", "[scene_yaml]") {
    CHECK(parse("film: {filter: gaussian}").film.filter_radius == 1.5);
    const FilmSettings film =
        parse(
            "film: {filter: {type: gaussian, radius: 2, sigma: 0.75}, crop: [1, 2, 3, 4], white_balance: A}")
            .film;
    CHECK(film.filter_radius == 2);
    CHECK(film.filter_sigma == 0.75);
    CHECK(film.crop == std::array<int, 4>{1, 2, 3, 4});
    CHECK(film.white_balance == illuminantSpectrum("A"));
    CHECK(parse("film: {white_balance: {blackbody: 3200}}").film.white_balance ==
          blackbodySpectrum(3200, true));
}

TEST_CASE("numbers may be written as people write them", "[scene_yaml]") {
    CHECK(parse("integrator: {max_depth: 1e3}").integrator.max_depth == 1000);
    CHECK(parse("integrator: {max_depth: 3.0}").integrator.max_depth == 3);
    CHECK(parse("sampler: {seed: 18446744073709551615}").sampler.seed == 18446744073709551615u);
    CHECK(parse("camera: {position: [+.5, -2., 1E-3]}").camera.position == Vec3d{0.5, -2, 1e-3});
}

TEST_CASE("spectra in all their forms", "[scene_yaml]") {
    const auto emitted = [](const std::string& spectrum, const std::string& named = "") {
        return parse(named + "environment: {radiance: " + spectrum + "}").environment->radiance;
    };
    CHECK(emitted("2") == constantSpectrum(2));
    CHECK(emitted("{illuminant: D65}") == *illuminantSpectrum("D65"));
    CHECK(emitted("{blackbody: 3000, normalise: false}") == blackbodySpectrum(3000, false));
    CHECK(emitted("{blackbody: 3000}") == blackbodySpectrum(3000, true));
    CHECK(emitted("{rgb: [1, 0.5, 0.25], space: linear}") == rgbEmission({1, 0.5, 0.25}));
    CHECK(emitted("{rgb: [1, 1, 1]}") == rgbEmission({1, 1, 1}));
    CHECK(emitted("{table: {nm: [300, 900], value: [1, 1]}}") == constantSpectrum(1));
    CHECK(emitted("{table: {nm: [400, 700], value: [1, 3]}, outside: clamp}") ==
          tableSpectrum({400, 700}, {1, 3}, Outside::Clamp));
    CHECK(emitted("{table: {nm: [400, 700], value: [1, 3]}, outside: zero}") ==
          tableSpectrum({400, 700}, {1, 3}, Outside::Zero));
    CHECK(emitted("lamp", "spectra: {lamp: {illuminant: A}}\n") == *illuminantSpectrum("A"));
    CHECK(emitted("again", "spectra: {lamp: 4, again: {ref: lamp, scale: 0.5}}\n") == constantSpectrum(2));

    const auto material = [](const std::string& text) {
        return parse("materials: {m: " + text + "}").materials.at(0);
    };
    CHECK(material("{type: dielectric, ior: {glass: N-BK7}}").eta == *glassIndex("N-BK7"));
    CHECK(material("{type: dielectric, ior: {cauchy: [1.5, 0.004]}}").eta == cauchyIndex({1.5, 0.004}));
    CHECK(material("{type: dielectric, ior: {sellmeier: {B: [1, 0.2, 1], C: [0.006, 0.02, 100]}}}").eta ==
          sellmeierIndex({1, 0.2, 1}, {0.006, 0.02, 100}));
    CHECK(material("{type: conductor, metal: Au}").k == metalIndex("Au")->second);
    CHECK(material("{type: conductor, eta: 0.2, k: 3}").eta == constantSpectrum(0.2));
    CHECK(material("{type: mirror, reflectance: 1}").type == MaterialType::Mirror);
    const Material frosted = material(
        "{type: rough_dielectric, ior: {glass: SF10}, roughness: 0.4, absorption: {rgb: [1, 0, 0], space: "
        "linear, scale: 3}}");
    CHECK(frosted.type == MaterialType::RoughDielectric);
    CHECK(frosted.eta == *glassIndex("SF10"));
    CHECK(frosted.roughness == 0.4);
    CHECK((*frosted.absorption)[300] == Approx(3 * rgbReflectance({1, 0, 0})[300]));
    CHECK_FALSE(material("{type: dielectric, ior: 1.5}").absorption);
    CHECK(*material("{type: dielectric, ior: 1.5, absorption: 2}").absorption == constantSpectrum(2));
    CHECK(material("{type: thin_dielectric, ior: 1.5}").eta == constantSpectrum(1.5));
    CHECK(material("{type: plastic, reflectance: 0.5}").eta == constantSpectrum(1.5));
    const Material bubble = material(
        "{type: thin_dielectric, ior: 1, "
        "thin_film: {thickness_nm: 400, ior: 1.33, relative_thickness: 0.5}}");
    CHECK(bubble.film_thickness_nm == 200);
    CHECK(bubble.film_index[0] == 1.33);
    CHECK(material("{type: thin_dielectric, ior: 1}").film_thickness_nm == 0);
    CHECK(material("{type: plastic, reflectance: 0.5}").roughness == 0);
    const Material pan = material(
        "{type: rough_conductor, metal: Al, roughness: 0.4, roughness_anisotropy: 0.7, "
        "anisotropy_rotation_deg: 45}");
    CHECK(pan.anisotropy == 0.7);
    CHECK(pan.anisotropy_rotation_deg == 45);
    CHECK(frosted.anisotropy == 0);
    const Material tile = material("{type: plastic, reflectance: 0.5, ior: 1.7, roughness: 0.2}");
    CHECK(tile.eta == constantSpectrum(1.7));
    CHECK(tile.roughness == 0.2);
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
    CHECK(materials("specular_weight: 0")[0].type == MaterialType::Diffuse);
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

TEST_CASE("one name means a reflectance to a wall and a light to a lamp", "[scene_yaml]") {
    const Scene scene = parse(
        "spectra: {c: {rgb: [0.5, 0.25, 0.75], space: linear}}\n"
        "materials: {m: {type: diffuse, reflectance: c}}\nenvironment: {radiance: c}\n");
    CHECK(scene.materials[0].reflectance == rgbReflectance({0.5, 0.25, 0.75}));
    CHECK(scene.environment->radiance == rgbEmission({0.5, 0.25, 0.75}));
}

TEST_CASE("spectrum files are found beside the scene", "[scene_yaml]") {
    const TemporaryFolder folder;
    folder.write("lamp.spd", "400 1\n700 3\n");
    folder.write("whole.csv", "nm,value\n360,1\n830,1\n");
    const std::string path =
        folder.write("scene.yaml", "crt: 1\nenvironment: {radiance: {file: lamp.spd, outside: zero}}\n");
    const Scene scene = loadScene(path);
    CHECK(scene.environment->radiance == tableSpectrum({400, 700}, {1, 3}, Outside::Zero));
    CHECK(scene.files_read == std::vector<std::string>{path, folder.path() + "/lamp.spd"});
    CHECK(scene.file == path);
    CHECK(parse("environment: {radiance: {file: whole.csv}}", {}, folder.path()).environment->radiance ==
          constantSpectrum(1));

    CHECK_THAT(refused("environment: {radiance: {file: lamp.spd}}", {}, folder.path()),
               Contains("scene.yaml:2:32: error") && Contains("say 'outside: clamp' or 'outside: zero'"));
    folder.write("broken.spd", "400 1\n500 x\n");
    CHECK_THAT(refused("environment: {radiance: {file: broken.spd, outside: zero}}", {}, folder.path()),
               Contains("scene.yaml:2:32: error") && Contains("broken.spd:2"));
    CHECK_THAT(refused("environment: {radiance: {file: lmap.spd, outside: zero}}", {}, folder.path()),
               Contains("scene.yaml:2:32: error: cannot find 'lmap.spd'; searched in " + folder.path()) &&
                   Contains("did you mean 'lamp.spd'?"));
}

TEST_CASE("meshes in the scene", "[scene_yaml]") {
    const Scene scene =
        parse(meshScene("mesh: {positions: [[0,0,0],[1,0,0],[1,1,0],[0,1,0]], faces: [[0,1,2,3]], "
                        "normals: [[0,0,1],[0,0,1],[0,0,1],[0,0,1]]}"));
    REQUIRE(scene.meshes.size() == 1);
    CHECK(scene.meshes[0].triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
    CHECK(scene.meshes[0].normal_index == scene.meshes[0].triangles);
    CHECK(scene.objects[0].material == 0);
    CHECK(scene.objects[0].emission == -1);
    CHECK(scene.objects[0].place.line == 4);
}

TEST_CASE("triangles without area are left out with a warning", "[scene_yaml]") {
    const int before = warningCount();
    const Scene scene =
        parse(meshScene("mesh: {positions: [[0,0,0],[1,0,0],[0,1,0],[2,0,0]], faces: [[0,1,2],[0,1,3]]}"));
    CHECK(scene.meshes[0].triangles.size() == 1);
    CHECK(warningCount() == before + 1);
}

TEST_CASE("placements multiply in the order they are written", "[scene_yaml]") {
    const auto point = [](const Matrix4d& m, const Vec3d& p) {
        Vec3d q{};
        for (std::size_t r = 0; r < 3; ++r)
            q[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
        return q;
    };
    const Scene one =
        parse(meshScene("mesh: " + kTriangle +
                        ", transform: [{scale: 2}, {rotate: {axis: [0, 0, 3], angle_deg: 90}}, "
                        "{translate: [10, 0, 0]}]"));
    // Quarter turns are exact.
    CHECK(point(one.objects[0].transforms.at(0), {1, 0, 0}) == Vec3d{10, 2, 0});
    CHECK(point(one.objects[0].transforms.at(0), {0, 1, 0}) == Vec3d{8, 0, 0});
    const Scene two = parse(meshScene(
        "mesh: " + kTriangle +
        ", transforms: [[], [{scale: [1, 2, 3]}, {matrix: [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]}]]"));
    REQUIRE(two.objects[0].transforms.size() == 2);
    CHECK(two.objects[0].transforms[0] == kIdentity4d);
    CHECK(point(two.objects[0].transforms[1], {1, 1, 1}) == Vec3d{6, 8, 10});
    CHECK(two.meshes.size() == 1);
}

TEST_CASE("an OBJ named twice is loaded once", "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Scene scene =
        parse(kGrey + "objects: [{obj: plain.obj, material: grey}, {obj: ./plain.obj, material: grey}]", {},
              folder.path());
    CHECK(scene.meshes.size() == 1);
    CHECK(scene.objects[1].mesh == 0);
    CHECK(scene.files_read == std::vector<std::string>{folder.path() + "/plain.obj"});
    CHECK_THAT(
        refused("objects: [{obj: plain.obj}]", {}, folder.path()),
        Contains("scene.yaml:2:17: error: 1 of 1 triangles of object 0 have no material; give them one with "
                 "'material: NAME'") &&
            Contains(
                "for instance 'materials: {grey: {type: diffuse, reflectance: 0.5}}' and 'material: grey'"));
    CHECK_THAT(refused(kGrey + "objects: [{obj: plain.obj}]", {}, folder.path()),
               Contains("for instance 'material: grey'"));
}

TEST_CASE("materials of an OBJ can be kept, replaced or ignored", "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("two.mtl", "newmtl body\nKd 0.5 0.5 0.5\nnewmtl Lamp.001\nKd 0 0 0\nKe 2 2 2\n");
    folder.write(
        "two.obj",
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl body\nf 1 2 3\nusemtl Lamp.001\nf 3 2 1\n");
    const Scene kept =
        parse("objects: [{obj: two.obj}, {obj: two.obj, material: from_mtl}]", {}, folder.path());
    REQUIRE(kept.meshes.size() == 1);
    CHECK(kept.meshes[0].material == std::vector<std::int32_t>{0, 1});
    CHECK(kept.meshes[0].emission == std::vector<std::int32_t>{-1, 0});
    CHECK(kept.materials.at(1).name == "two.obj:Lamp.001");

    const Scene replaced =
        parse(kGrey + "objects: [{obj: two.obj, material_overrides: {Lamp.001: grey}}]", {}, folder.path());
    CHECK(replaced.materials.size() == 2);
    CHECK(replaced.meshes.at(0).material == std::vector<std::int32_t>{1, 0});
    CHECK(replaced.meshes[0].emission.empty());

    const Scene ignored =
        parse(kGrey + "objects: [{obj: two.obj, material: grey, override: true}]", {}, folder.path());
    CHECK(ignored.meshes.at(0).material.empty());
    CHECK(ignored.materials.size() == 1);
    CHECK(ignored.objects.at(0).material == 0);

    CHECK_THAT(refused(kGrey + "objects: [{obj: two.obj, material_overrides: {Lmap.001: grey}}]", {},
                       folder.path()),
               Contains("scene.yaml:3:47: error: no face of 'two.obj' has a material 'Lmap.001'") &&
                   Contains("did you mean 'Lamp.001'?"));
    CHECK_THAT(refused(kGrey + "objects: [{obj: two.obj, material: grey, override: true, "
                               "material_overrides: {body: grey}}]",
                       {}, folder.path()),
               Contains("'override: true' replaces all materials of the OBJ; none is left for this"));
    CHECK_THAT(refused("objects: [{obj: two.obj, override: true}]", {}, folder.path()),
               Contains("name a material with 'material:'"));
    CHECK_THAT(refused("objects: [{obj: two.obj, material: from_mtl, override: true}]", {}, folder.path()),
               Contains("name a material with 'material:'"));
    for (const char* key : {"override: true", "mtl: {color: srgb}", "material_overrides: {a: grey}"})
        CHECK_THAT(
            refused(fmt::format("{}objects: [{{mesh: {}, material: grey, {}}}]\n", kGrey, kTriangle, key)),
            Contains("only an OBJ has"));
}

TEST_CASE("the material of an object fills the faces of an OBJ that have none", "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("some.mtl", "newmtl body\nKd 0.5 0.5 0.5\nKe 1 1 1\n");
    folder.write("some.obj",
                 "mtllib some.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl body\nf 3 2 1\nusemtl "
                 "(null)\nf 2 3 1\n");
    const Scene filled = parse(kGrey + "objects: [{obj: some.obj, material: grey}]", {}, folder.path());
    CHECK(filled.materials.size() == 2);
    CHECK(filled.objects.at(0).material == 0);
    CHECK(filled.meshes.at(0).material == std::vector<std::int32_t>{-1, 1, -1});
    CHECK(filled.meshes[0].emission == std::vector<std::int32_t>{-1, 0, -1});
    // Names that no MTL defines can be given a material too.
    const Scene named = parse(
        kGrey + "objects: [{obj: some.obj, material: grey, material_overrides: {(null): grey, body: grey}}]",
        {}, folder.path());
    CHECK(named.meshes.at(0).material == std::vector<std::int32_t>{-1, 0, 0});
    CHECK(named.meshes[0].emission.empty());
    CHECK_THAT(refused(kGrey + "objects: [{obj: some.obj}]", {}, folder.path()),
               Contains("2 of 3 triangles of object 0 have no material"));
    CHECK_THAT(
        refused(kGrey + "objects: [{obj: some.obj, material_overrides: {(null): grey}}]", {}, folder.path()),
        Contains("1 of 3 triangles of object 0 have no material"));
    CHECK_THAT(saidOf(kGrey + "objects: [{obj: some.obj, material: grey}]", folder.path()),
               !Contains("has no face for material"));

    folder.write("all.obj", "mtllib some.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl body\nf 3 2 1\n");
    CHECK(parse(kGrey + "objects: [{obj: all.obj, material: grey}]", {}, folder.path())
              .meshes.at(0)
              .material == std::vector<std::int32_t>{1});
    CHECK_THAT(saidOf(kGrey + "objects: [{obj: all.obj, material: grey}]", folder.path()),
               Contains("scene.yaml:3:36: object 0 has no face for material 'grey': the OBJ gives each its "
                        "own; 'override: true' replaces them all"));
}

TEST_CASE("an OBJ whose MTL is missing needs a material, and says which file is missing",
          "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("lost.obj", "mtllib lost.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl body\nf 3 2 1\n");
    CHECK_THAT(refused(kGrey + "objects: [{obj: lost.obj}]", {}, folder.path()),
               Contains("1 of 1 triangles of object 0 have no material (the OBJ names 'lost.mtl', which is "
                        "not there); give them one with 'material: NAME'"));
    CHECK(parse(kGrey + "objects: [{obj: lost.obj, material: grey}]", {}, folder.path())
              .meshes.at(0)
              .material == std::vector<std::int32_t>{-1});
    CHECK(parse(kGrey + "objects: [{obj: lost.obj, material_overrides: {body: grey}}]", {}, folder.path())
              .meshes.at(0)
              .material == std::vector<std::int32_t>{0});
}

TEST_CASE("an object says what the colours of its MTL are", "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\n");
    folder.write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
    const Scene scene = parse(
        "objects: [{obj: a.obj}, {obj: a.obj, mtl: {color: srgb}}, {obj: a.obj, mtl: {color: linear}}]", {},
        folder.path());
    CHECK(scene.meshes.size() == 2);
    CHECK(scene.objects.at(2).mesh == scene.objects.at(0).mesh);
    CHECK(scene.materials.at(0).reflectance == constantSpectrum(.5));
    CHECK(scene.materials.at(1).reflectance == constantSpectrum(srgbToLinear(.5)));
    CHECK_THAT(refused("objects: [{obj: a.obj, mtl: {color: gamma}}]", {}, folder.path()),
               Contains("linear") && Contains("srgb"));
}

TEST_CASE("unused names are warnings, not errors", "[scene_yaml]") {
    const int before = warningCount();
    parse("spectra: {a: 1}\nmaterials: {b: {type: diffuse, reflectance: 0}}");
    CHECK(warningCount() == before + 2);
    CHECK_THAT(
        refused("spectra: {a: {rgb: [1, 2]}}"),
        Contains("scene.yaml:2:20: error: expected a list of 3 numbers for 'rgb', found a list of 2"));
}

TEST_CASE("aliases are welcome, a byte order mark and CRLF are borne", "[scene_yaml]") {
    const Quiet quiet;
    const Scene scene = parseScene(
        "\xef\xbb\xbf"
        "crt: 1\r\ncamera: {position: &p [1, 2, 3], target: [0, 0, 0], up: *p}\r\n"
        "film: {resolution: [2, 2]}\r\n",
        "scene.yaml", ".", {{"camera.up", "[0, 1, 0]"}});
    CHECK(scene.camera.position == Vec3d{1, 2, 3});
    CHECK(scene.camera.up == Vec3d{0, 1, 0});
    CHECK_THAT(refusal("\xef\xbb\xbf"
                       "ctr: 1")
                   .what(),
               Contains("scene.yaml:1:1: error: unknown key 'ctr' in the scene"));
}

// ---- Bad files ------------------------------------------------------------------------------------------

TEST_CASE("files that are not there or not text", "[scene_yaml][refused]") {
    const TemporaryFolder folder;
    CHECK_THROWS_WITH(loadScene(folder.path() + "/none.yaml"),
                      Contains("none.yaml: error: cannot be opened: No such file"));
    CHECK_THROWS_WITH(loadScene(folder.path()), Contains("this is a directory"));
    CHECK_THROWS_WITH(
        loadScene(folder.write("empty.yaml", "")),
        Contains("empty.yaml: error: there is nothing in this file; a scene begins with 'crt: 1'"));
    CHECK_THROWS_WITH(loadScene(folder.write("comment.yaml", "# nothing\n")),
                      Contains("there is nothing in this file"));
    CHECK_THROWS_WITH(loadScene(folder.write("zero.yaml", std::string("crt: 1\nx\0y", 10))),
                      Contains("zero.yaml:2:2: error: byte 0x00 at offset 8 is not text"));
    CHECK_THROWS_WITH(loadScene(folder.write("png.yaml", "\x89PNG\r\n\x1a\n")),
                      Contains("png.yaml:1:1: error: byte 0x89 at offset 0"));
    CHECK_THROWS_WITH(loadScene(folder.write("latin.yaml", "crt: 1\ntitle: caf\xe9\n")),
                      Contains("latin.yaml:2:11: error: byte 0xe9") && Contains("title: caf\ufffd\n"));
}

TEST_CASE("texts that are not YAML, or not the YAML of a scene", "[scene_yaml][refused]") {
    CHECK_THAT(refused("film: {resolution: [1, 2}\n"), Contains("scene.yaml:2:25: error: not valid YAML"));
    CHECK_THAT(refused("camera:\n\tfov: 3\n"),
               Contains("scene.yaml:3:5: error: not valid YAML") && Contains("indent with blanks"));
    CHECK_THAT(refused("title: *nowhere\n"),
               Contains("scene.yaml:2:8: error: not valid YAML: the referenced anchor is not defined"));
    CHECK_THAT(refusal("- 1\n- 2\n").what(),
               Contains("scene.yaml:1:1: error: expected a map for the scene, found a list of 2"));
    CHECK_THAT(refusal("~").what(), Contains("expected a map for the scene, found nothing"));
    CHECK_THAT(refused("---\ncrt: 1\n"),
               Contains("scene.yaml:2:1: error: a second YAML document begins here"));
    CHECK_THAT(refused("title: !!str x\n"),
               Contains("error: the YAML tag 'tag:yaml.org,2002:str' means nothing in a scene"));
    CHECK_THAT(refused("? [1, 2]\n: 3\n"),
               Contains("scene.yaml:2:3: error: a list as a key is not possible here"));
    CHECK_THAT(refused("title: " + std::string(3000, '[') + "\n"),
               Contains("nested more than 64 levels deep"));
    CHECK_THAT(refused("objects: &a [{name: x, transforms: *a}]\n"),
               Contains("scene.yaml:2:36: error: this alias is inside the value it stands for"));
    CHECK_THAT(refused("film: {<<: {resolution: [1, 1]}}\n"),
               Contains("scene.yaml:2:8: error: merge keys ('<<') are not part of a scene"));

    std::string laughs = "spectra:\n  a: &a [x, x, x, x, x, x, x, x, x, x]\n";
    for (char c = 'b'; c <= 'k'; ++c) {
        laughs += std::string("  ") + c + ": &" + c + " [";
        for (int i = 0; i < 10; ++i) laughs += std::string(i > 0 ? ", *" : "*") + static_cast<char>(c - 1);
        laughs += "]\n";
    }
    CHECK_THAT(refused(laughs),
               Contains("values behind aliases, which take") && Contains("set CRT_SCENE_MEMORY="));
}

TEST_CASE("the version comes first", "[scene_yaml][refused]") {
    CHECK_THAT(refusal("title: x\n").what(),
               Contains("scene.yaml:1:1: error: 'crt' is missing in the scene"));
    CHECK_THAT(refusal("title: x\ncrt: 1\n").what(),
               Contains("scene.yaml:2:1: error: 'crt' must be the first key of a scene"));
    CHECK_THAT(refusal("crt: 2\n").what(), Contains("scene.yaml:1:6: error: 'crt' is 2; it must be 1"));
}

TEST_CASE("unknown, misspelt and duplicate keys", "[scene_yaml][refused]") {
    // The whole message, once.
    CHECK(refused("materials:\n  white: {type: diffuse, reflectence: 0.5}\n") ==
          "scene.yaml:3:26: error: unknown key 'reflectence' in material 'white'\n"
          "    3 |   white: {type: diffuse, reflectence: 0.5}\n"
          "      |                          ^~~~~~~~~~~ did you mean 'reflectance'?\n"
          "      = keys of a diffuse material: type, reflectance, normal_map, opacity");
    CHECK_THAT(refused("flim: {}\n"), Contains("scene.yaml:2:1: error: unknown key 'flim' in the scene") &&
                                          Contains("did you mean 'film'?"));
    CHECK_THAT(refused("nee: false\n"),
               Contains("unknown key 'nee' in the scene") && Contains("'nee' is a key of integrator"));
    CHECK_THAT(refused("path: {nee: false}\n"), Contains("unknown key 'path' in the scene"));
    CHECK_THAT(refused("title: a\ntitle: b\n"),
               Contains("scene.yaml:3:1: error: duplicate key 'title', already given in line 2"));
    CHECK_THAT(refused("materials: {a: {type: difuse}}\n"),
               Contains("scene.yaml:2:23: error: expected one of diffuse, mirror, conductor, "
                        "rough_conductor, dielectric, rough_dielectric, thin_dielectric, plastic, "
                        "openpbr, mix, two_sided for 'type'") &&
                   Contains("did you mean 'diffuse'?"));
    CHECK_THAT(refused("materials: {a: {typ: diffuse}}\n"),
               Contains("scene.yaml:2:17: error: unknown key 'typ' in material 'a'") &&
                   Contains("did you mean 'type'?"));
    CHECK_THAT(refused("materials: {a: {reflectance: 1}}\n"),
               Contains("scene.yaml:2:16: error: 'type' is missing in material 'a'"));
    CHECK_THAT(refused("materials: {a: {type: diffuse}}\n"),
               Contains("scene.yaml:2:16: error: 'reflectance' is missing in material 'a'"));
    CHECK_THAT(refused("camera: {fov: 40, focal_length: 3}\n"),
               Contains("'fov' and 'focal_length' in camera exclude each other") &&
                   Contains("'focal_length' in camera needs 'sensor' too"));
    CHECK_THAT(refused("objects: [{material: m}]\n"), Contains("object 0 needs obj or mesh"));
}

TEST_CASE("columns count characters, not bytes", "[scene_yaml][refused]") {
    const Error e = refusal("crt: 1\nmaterials: {grün: {refl: 1}}\n");
    CHECK_THAT(e.what(), Contains("scene.yaml:2:19: error: 'type' is missing in material 'grün': one of "
                                  "diffuse, mirror, conductor, rough_conductor, dielectric, "
                                  "rough_dielectric, thin_dielectric, plastic, openpbr, mix, two_sided\n"
                                  "    2 | materials: {grün: {refl: 1}}\n"
                                  "      |                   ^"));
    CHECK(e.place().file == "scene.yaml");
    CHECK(e.place().line == 2);
    CHECK(e.place().column == 19);
}

TEST_CASE("long lines are cut around the place", "[scene_yaml][refused]") {
    std::string table = "environment: {radiance: {table: {nm: [";
    for (int i = 0; i < 200; ++i) table += std::to_string(360 + i) + ", ";
    const std::string message = refused(table + "nan], value: [1]}}}\n");
    CHECK_THAT(message,
               Contains("value 201 of 'nm', found 'nan': NaN and infinity have no place in a scene"));
    CHECK_THAT(message, Contains(" | …") && Contains("^~~"));
    CHECK(message.size() < 500);
}

TEST_CASE("wrong types and impossible numbers", "[scene_yaml][refused]") {
    CHECK_THAT(refused("film: 3\n"), Contains("scene.yaml:2:7: error: expected a map for film, found '3'"));
    CHECK_THAT(refused("film:\n"),
               Contains("scene.yaml:2:1: error: expected a map for film, found nothing"));
    CHECK_THAT(refused("objects: {a: 1}\n"), Contains("expected a list for 'objects', found a map"));
    CHECK_THAT(refused("camera: {fov: wide}\n"),
               Contains("scene.yaml:2:15: error: expected a number for 'fov', found 'wide'"));
    CHECK_THAT(refused("camera: {fov: '40'}\n"),
               Contains("found the text \"40\"") && Contains("leave the quotes out"));
    CHECK_THAT(refused("camera: {fov: $fov}\n"), Contains("scenes have no variables; use --set"));
    CHECK_THAT(refused("camera: {position: [0, 0]}\n"),
               Contains("expected a list of 3 numbers for 'position', found a list of 2"));
    CHECK_THAT(
        refused("camera: {position: [0, .nan, -.inf]}\n"),
        Contains("scene.yaml:2:24: error: expected a number for value 2 of 'position', found '.nan'") &&
            Contains("scene.yaml:2:30: error"));
    CHECK_THAT(refused("camera: {position: [0, 1e999, 0]}\n"), Contains("outside the range of a double"));
    CHECK_THAT(
        refused("integrator: {max_depth: 012}\n"),
        Contains(
            "scene.yaml:2:25: error: expected a whole number for 'max_depth', found '012': leading zeros") &&
            Contains("write 12"));
    CHECK_THAT(refused("integrator: {max_depth: 0x10}\n"), Contains("write it in decimal"));
    CHECK_THAT(refused("integrator: {max_depth: 1.5}\n"), Contains("it is not whole"));
    CHECK_THAT(refused("integrator: {max_depth: -1}\n"),
               Contains("'max_depth' is -1; it must be 0 to 1000000000"));
    CHECK_THAT(refused("integrator: {max_depth: 1e10}\n"),
               Contains("'max_depth' is 1e10; it must be 0 to 1000000000"));
    CHECK_THAT(refused("integrator: {nee: yes}\n"),
               Contains("expected true or false for 'nee', found 'yes'") && Contains("write true"));
    CHECK_THAT(refused("integrator: {nee: 0}\n"), Contains("write false"));
    CHECK_THAT(refused("integrator: {type: pth}\n"),
               Contains("expected one of path, normals, aabb for 'type', found 'pth'") &&
                   Contains("did you mean 'path'?"));
    CHECK_THAT(refused("sampler: {samples: 0}\n"), Contains("'samples' is 0; it must be 1 to"));
    CHECK_THAT(refused("sampler: {seed: -1}\n"), Contains("'seed' is -1; it must be 0 or more"));
    CHECK_THAT(refused("sampler: {seed: 18446744073709551616}\n"), Contains("it is too large"));
    CHECK_THAT(refused("title: 2024\n"),
               Contains("expected text for 'title', found '2024'") && Contains("put it in quotes"));
    CHECK_THAT(refused("film: {exposure_ev: 1000}\n"),
               Contains("'exposure_ev' is 1000; it must be -100 to 100"));
}

TEST_CASE("film sizes that cannot be", "[scene_yaml][refused]") {
    CHECK_THAT(refused("film: {resolution: [0, 0]}\n"),
               Contains("scene.yaml:2:21: error: value 1 of 'resolution' is 0; it must be 1 to 65535") &&
                   Contains("scene.yaml:2:24: error: value 2"));
    CHECK_THAT(refused("film: {resolution: [100000, 100000]}\n"),
               Contains("value 1 of 'resolution' is 100000; it must be 1 to 65535"));
    CHECK_THAT(
        refused("film: {resolution: [65535, 65535]}\n"),
        Contains("scene.yaml:2:20: error: 65535 x 65535 are 4294836225 pixels; a film has at most 2^31"));
    CHECK_THAT(refused("film: {resolution: [4, 4], crop: [0, 0, 5, 4]}\n"),
               Contains("beyond the film of 4 x 4 pixels"));
    CHECK_THAT(refused("film: {crop: [3, 0, 3, 4]}\n"), Contains("this window is empty"));
    CHECK_THAT(refused("film: {filter: {type: box, sigma: 1}}\n"),
               Contains("only a gaussian filter has a sigma"));
    CHECK_THAT(refused("film: {filter: Gausian}\n"), Contains("did you mean 'gaussian'?"));
    CHECK_THAT(refused("film: {white_balance: d65}\n"),
               Contains("there is no spectrum 'd65'") && Contains("did you mean 'D65'?"));
    CHECK_THAT(refused("film: {white_balance: 0}\n"), Contains("no luminance"));
}

TEST_CASE("cameras that look nowhere", "[scene_yaml][refused]") {
    CHECK_THAT(refused("camera: {position: [1, 2, 3], target: [1, 2, 3]}\n"),
               Contains("scene.yaml:2:39: error: position and target are the same point"));
    CHECK_THAT(refused("camera: {up: [0, 0, 0]}\n"), Contains("scene.yaml:2:14: error: up has length 0"));
    CHECK_THAT(refused("camera: {up: [0, 0, -5]}\n"),
               Contains("scene.yaml:2:14: error: up is parallel to the view"));
    CHECK_THAT(refused("camera: {position: [0, 9, 0], target: [0, 0, 0]}\n"),
               Contains("up is parallel to the view") && Contains("set 'up'"));
    CHECK(count(refused("camera: {positoin: [0, 0, 2], target: [0, 0, 0]}\n"), ": error: ") == 1);
    CHECK_THAT(refused("camera: {fov: 0}\n"),
               Contains("scene.yaml:2:15: error: 'fov' is 0; it must be between 0 and 180, both excluded"));
    CHECK_THAT(refused("camera: {fov: 180}\n"), Contains("'fov' is 180"));
    CHECK_THAT(refused("camera: {focal_length: -1, sensor: [1, 0]}\n"),
               Contains("'focal_length' is -1; it must be above 0") && Contains("value 2 of 'sensor' is 0"));
    CHECK_THAT(refused("camera: {aperture_radius: -1}\n"),
               Contains("'aperture_radius' is -1; it must be 0 or more"));
}

TEST_CASE("spectra that cannot be", "[scene_yaml][refused]") {
    CHECK_THAT(refusedReflectance("1.5"),
               Contains("scene.yaml:3:35: error: 'reflectance' of material 'm' is 1.5; it must be 0 to 1"));
    CHECK_THAT(refusedReflectance("{table: {nm: [400, 550, 700], value: [0.1, 1.25, 0.5]}, outside: clamp}"),
               Contains("'reflectance' of material 'm' reaches 1.25 at 550 nm; it must be 0 to 1"));
    CHECK_THAT(refusedReflectance("-0.1"), Contains("is -0.1; it must be 0 to 1"));
    CHECK_THAT(refusedReflectance(".nan"), Contains("NaN and infinity have no place in a scene"));
    CHECK_THAT(refusedReflectance("{rgb: [1.2, 0, 0]}"),
               Contains("a component of this colour is 1.2; a reflectance must be 0 to 1"));
    CHECK_THAT(refusedReflectance("{rgb: [0.2, 0, 0], spcae: srgb}"), Contains("did you mean 'space'?"));
    CHECK_THAT(
        refusedReflectance("{table: {nm: [400, 700], value: [0, 1]}}"),
        Contains("scene.yaml:3:43: error: the data go from 400 to 700 nm") && Contains("'outside: clamp'"));
    CHECK_THAT(refusedReflectance("{table: {nm: [400, 700], value: [0, 1]}, outside: error}"),
               Contains("scene.yaml:3:85: error: the data go from 400 to 700 nm"));
    CHECK_THAT(refusedReflectance("{table: {nm: [400, 700, 600], value: [0, 1, 0]}, outside: zero}"),
               Contains("scene.yaml:3:59: error: wavelengths must increase, but 600 nm follows 700 nm"));
    CHECK_THAT(refusedReflectance("{table: {nm: [400, 700], value: [0]}, outside: zero}"),
               Contains("the table has 2 wavelengths but 1 values"));
    CHECK_THAT(refusedReflectance("{file: no.spd, outside: zero}"),
               Contains("scene.yaml:3:42: error: cannot find 'no.spd'; searched in ."));
    CHECK_THAT(refusedReflectance("{ilum: D65}"),
               Contains("unknown key 'ilum' in 'reflectance' of material 'm'") &&
                   Contains("one of: table, file, rgb"));
    CHECK_THAT(refusedReflectance("{iluminant: D65}"), Contains("did you mean 'illuminant'?"));
    CHECK_THAT(refusedReflectance("{rgb: [0, 0, 0], glass: SF10}"),
               Contains("'rgb' and 'glass' in 'reflectance' of material 'm' exclude each other"));
    CHECK_THAT(refusedReflectance("D65"),
               Contains("there is no spectrum 'D65'") && Contains("write {illuminant: D65}"));
    CHECK_THAT(refusedReflectance("[1, 2]"), Contains("expected a number, the name of a spectrum or a map"));
    CHECK_THAT(refused("environment: {radiance: -1}\n"),
               Contains("scene.yaml:2:25: error: 'radiance' of environment is -1; it must be 0 to 1e+25"));
    CHECK_THAT(refused("environment: {radiance: {rgb: [5, 1, 1]}}\n"),
               Contains("an sRGB-encoded colour must be 0 to 1") && Contains("add 'space: linear'"));
    CHECK_THAT(refused("environment: {radiance: {blackbody: 0}}\n"),
               Contains("'blackbody' is 0; it must be 100 to"));
    CHECK_THAT(refused("spectra: {a: b, b: {ref: a}}\nenvironment: {radiance: a}\n"),
               Contains("spectrum 'a' is defined by itself"));
    CHECK_THAT(refused("spectra: {0.5: 1}\n"), Contains("'0.5' cannot name a spectrum"));
    CHECK_THAT(refused("spectra: {withe: 1, other: whte}\n"),
               Contains("there is no spectrum 'whte'") && Contains("did you mean 'withe'?"));
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: {rgb: [1, 1, 1]}}}\n"),
               Contains("a refractive index is not a colour"));
    const auto refusedMaterial = [](const std::string& m) {
        return refused("materials: {m: " + m + "}\n");
    };
    CHECK_THAT(refusedMaterial("{type: rough_dielectric, ior: 1.5}"), Contains("'roughness' is missing"));
    CHECK_THAT(refusedMaterial("{type: rough_dielectric, ior: 1.5, roughness: 1.01}"),
               Contains("scene.yaml:2:62: error: 'roughness' is 1.01; it must be 0 to 1"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, absorption: -1}"),
               Contains("scene.yaml:2:57: error: 'absorption' of material 'm' is -1; it must be 0 to"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, absorption: .inf}"), Contains("infinity"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, absorption: {rgb: [2, 0, 0], space: linear}}"),
               Contains("a component of this absorption is 2, beyond 1") && Contains("'scale'"));
    CHECK_THAT(refusedMaterial("{type: thin_dielectric, ior: 1.5, absorption: 1}"),
               Contains("unknown key 'absorption'"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, roughness: 0.1}"),
               Contains("unknown key 'roughness'"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, thin_film: {thickness: 300, ior: 1.3}}"),
               Contains("unknown key 'thickness'") && Contains("did you mean 'thickness_nm'?"));
    CHECK_THAT(refusedMaterial("{type: dielectric, ior: 1.5, thin_film: {thickness_nm: 300}}"),
               Contains("'ior' is missing"));
    CHECK_THAT(refusedMaterial("{type: diffuse, reflectance: 1, thin_film: {thickness_nm: 300, ior: 1.3}}"),
               Contains("unknown key 'thin_film'"));
    CHECK_THAT(refusedMaterial("{type: rough_dielectric, ior: 1.5, roughness: 0.5, "
                               "thin_film: {thickness_nm: 300, ior: 1.3, "
                               "relative_thickness: {checker: [0, 1]}}}"),
               Contains("equally thick everywhere") && Contains("take a dielectric"));
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: 1.5, thin_film: {thickness_nm: 300, "
                       "ior: 1.3, relative_thickness: {checker: [0, 1]}}}}\n"
                       "objects: [{mesh: {positions: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "
                       "faces: [[0, 1, 2]]}, material: m}]\n"),
               Contains("has a texture, but the mesh of object 0 has no texture coordinates"));
    CHECK_THAT(refusedMaterial("{type: rough_conductor, metal: Al, roughness: 0.5, anisotropy: 0.5}"),
               Contains("unknown key 'anisotropy'"));
    CHECK_THAT(refusedMaterial("{type: rough_conductor, metal: Al, roughness: {checker: [0, 1]}, "
                               "roughness_anisotropy: 0.5}"),
               Contains("equally rough everywhere") && Contains("give 'roughness' a number"));
    CHECK_THAT(refusedMaterial("{type: rough_dielectric, ior: 1.5, roughness: 0.5, "
                               "roughness_anisotropy: 0.5, thin_film: {thickness_nm: 300, ior: 1.3}}"),
               Contains("as rough in every direction") && Contains("leave 'thin_film'"));
    const auto refusedOpenPbr = [&](const std::string& keys) {
        return refusedMaterial("{type: openpbr, " + keys + "}");
    };
    for (const auto& [keys, why, instead] :
         {std::tuple{"subsurface_weight: 1", "wanders below a surface", "leave 'subsurface_weight' out"},
          std::tuple{"coat_weight: 1", "no coats on openpbr", "take a plastic"},
          std::tuple{"fuzz_weight: 1", "no fuzz", "leave 'fuzz_weight' out"},
          std::tuple{"emission_luminance: 1", "emission from objects", "give the object 'emission'"},
          std::tuple{"geometry_thin_walled: true", "no thin walls", "take a thin_dielectric"},
          std::tuple{"base_diffuse_roughness: 1", "no rough diffuse bases", "leave"},
          std::tuple{"base_metalness: 1, specular_weight: 2", "more light than there is", "1 or less"},
          std::tuple{"specular_color: 0.5", "no dielectric tints", "'base_metalness' 1"},
          std::tuple{"specular_roughness_anisotropy: 0.5", "as rough in every direction", "leave it out"},
          std::tuple{"specular_roughness: {checker: [0, 1]}", "equally rough everywhere", "a number"},
          std::tuple{"specular_ior: 0.9", "an index of 1 to 10", "from 1 on"},
          std::tuple{"transmission_weight: 1, transmission_color: 0.5", "tint the surface itself",
                     "give 'transmission_depth'"},
          std::tuple{"transmission_weight: 1, transmission_color: 0, transmission_depth: 1", "opaque",
                     "above 0"},
          std::tuple{"thin_film_weight: 1", "films on clear dielectrics", "'transmission_weight' 1"},
          std::tuple{"base_metalness: 1, specular_roughness: {checker: [0, 1]}, "
                     "specular_roughness_anisotropy: 1",
                     "equally rough everywhere", "a number"},
          std::tuple{"transmission_weight: 1, transmission_color: 0.5, transmission_depth: 1, "
                     "geometry_opacity: 0.5",
                     "closed", "leave 'geometry_opacity'"}}) {
        INFO(keys);
        CHECK_THAT(refusedOpenPbr(keys), Contains(why) && Contains(instead));
    }
    // Of slabs that are not there keys may say anything.
    CHECK_NOTHROW(parse("materials: {m: {type: openpbr, base_metalness: 1, base_diffuse_roughness: 1, "
                       "transmission_color: 0.5, specular_color: 0.5}}\n"));
    CHECK_THAT(refusedOpenPbr("coat_color: 1"), Contains("unknown key 'coat_color'"));
    CHECK_THAT(refused("materials: {m: {type: openpbr, transmission_weight: 0.5}, "
                       "t: {type: two_sided, front: m, back: m}}\n"),
               Contains("lets light through"));
    CHECK_THAT(refusedMaterial("{type: plastic, reflectance: 0.5, ior: 0.9}"),
               Contains("'ior' is 0.9; it must be 1 to 10"));
    CHECK_THAT(refusedMaterial("{type: plastic}"), Contains("'reflectance' is missing"));
    CHECK_THAT(refusedMaterial("{type: plastik, reflectance: 1}"), Contains("did you mean 'plastic'?"));
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: 0}}\n"),
               Contains("'ior' of material 'm' is 0; it must be 0.001 to 1000"));
    CHECK_THAT(
        refused("materials: {m: {type: dielectric, ior: {sellmeier: {B: [-3, 0, 0], C: [0, 0, 0]}}}}\n"),
        Contains("Sellmeier"));
    CHECK_THAT(refused("materials: {m: {type: conductor, metal: Ax}}\n"),
               Contains("scene.yaml:2:41: error: expected one of") && Contains("did you mean 'A"));
    CHECK_THAT(refused("materials: {m: {type: conductor, metal: Au, eta: 1, k: 1}}\n"),
               Contains("'metal' and 'eta' in material 'm' exclude each other"));
}

TEST_CASE("objects that cannot be", "[scene_yaml][refused]") {
    CHECK_THAT(refused(kGrey + "objects: [{obj: none.obj, material: grey}]\n"),
               Contains("scene.yaml:3:17: error: cannot find 'none.obj'; searched in ."));
    CHECK_THAT(refused(kGrey + "objects: [{obj: /none/none.obj, material: grey}]\n"),
               Contains("there is no file '/none/none.obj'"));
    CHECK_THAT(refused(kGrey + "objects: [{obj: /tmp, material: grey}]\n"), Contains("is a directory"));
    CHECK_THAT(refused(kGrey + "objects: [{mesh: " + kTriangle + ", material: gray}]\n"),
               Contains("there is no material 'gray'") && Contains("did you mean 'grey'?"));
    CHECK_THAT(refused("objects: [{mesh: " + kTriangle + "}]\n"),
               Contains("scene.yaml:2:11: error: 'material' is missing in object 0"));
    CHECK_THAT(refused("objects: [{mesh: " + kTriangle + ", material: from_mtl}]\n"),
               Contains("only an OBJ has materials of its own"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0, 0]], faces: [[0, 0, 1]]}")),
               Contains("face 0 names position 1, but there are only 1"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0, 0]], faces: [[0, 0, -1]]}")),
               Contains("an index of face 0 is -1; it must be 0 to"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0, 0]], faces: [[0, 0]]}")),
               Contains("expected a list of 3 or more indices for face 0, found a list of 2"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0]], faces: [[0, 0, 0]]}")),
               Contains("expected a list of 3 numbers for position 0"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0, 0]], faces: []}")),
               Contains("a mesh without faces cannot be seen"));
    CHECK_THAT(
        refused(meshScene("mesh: {positions: [[0,0,0],[4,0,0],[1,1,0],[0,4,0]], faces: [[1,2,3,0]]}")),
        Contains("face 0 is not convex"));
    CHECK_THAT(refused(meshScene(
                   "mesh: {positions: [[0,0,0],[4,0,0],[1,1,0]], faces: [[0,1,2]], normals: [[0,0,1]]}")),
               Contains("there are 1 normals for 3 positions"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transform: [{scale: 0}]")),
               Contains("a scale of 0 flattens"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle +
                                 ", transform: [{rotate: {axis: [0, 0, 0], angle_deg: 1}}]")),
               Contains("an axis of length 0"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transform: [{tarnslate: [0, 0, 0]}]")),
               Contains("did you mean 'translate'?"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle +
                                 ", transform: [{matrix: [1,0,0,0, 1,0,0,0, 0,0,1,0, 0,0,0,1]}]")),
               Contains("cannot be inverted"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle +
                                 ", transform: [{matrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]}]")),
               Contains("the last row must be 0 0 0 1"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transform: [{scale: 1e200}, {scale: 1e200}]")),
               Contains("overflows"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transforms: []")),
               Contains("an object with no placement is nowhere"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", emission: {radiance: -2}")),
               Contains("'radiance' of the emission of object 0 is -2; it must be 0 to 1e+25"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", emission: {radiance: .nan}")), Contains("NaN"));
}

TEST_CASE("outputs that cannot be", "[scene_yaml][refused]") {
    CHECK_THAT(
        refused("outputs: [{file: a.jpg}]\n"),
        Contains(
            "scene.yaml:2:18: error: 'a.jpg' does not end in one of .exr, .png, .ppm, .pfm; add 'format'"));
    CHECK_THAT(refused("outputs: [{file: a.png, aovs: [depth]}]\n"),
               Contains("only exr files hold more than the image"));
    CHECK_THAT(refused("outputs: [{file: a.exr, aovs: [dpeth]}]\n"), Contains("did you mean 'depth'?"));
    CHECK_THAT(refused("outputs: [{file: a.exr}, {file: a.exr}]\n"), Contains("'a.exr' is written twice"));
    CHECK_THAT(refused("outputs: [{format: exr}]\n"), Contains("'file' is missing in output 0"));
}

TEST_CASE("all errors of a file come at once, in its order", "[scene_yaml][refused]") {
    const Error e =
        refusal("crt: 1\nsampler: {sed: 1}\nfilm: {resolution: [0, 1]}\ncamera: {fov: 0}\nouputs: []\n");
    const std::string text = e.what();
    CHECK(count(text, ": error: ") == 4);
    CHECK(text.find("sed") < text.find("resolution"));
    CHECK(text.find("resolution") < text.find("'fov' is 0"));
    CHECK(text.find("'fov' is 0") < text.find("ouputs"));
    CHECK(e.place().line == 2);
    CHECK(e.place().column == 11);

    std::string many = "camera: {}\nspectra:\n";
    for (int i = 0; i < 1000; ++i) many += "  s" + std::to_string(i) + ": nothing\n";
    CHECK_THAT(refused(many), Contains("… and 950 more errors"));
}

// ---- Overrides ------------------------------------------------------------------------------------------

TEST_CASE("overrides change the scene before it is checked", "[scene_yaml][override]") {
    CHECK(parseOverride("film.resolution=[128,128]").path == "film.resolution");
    CHECK(parseOverride("a=b=c").value == "b=c");
    CHECK_THROWS_AS(parseOverride("film"), Error);
    CHECK_THROWS_WITH(parseOverride("=3"), Contains("expected KEY.PATH=VALUE"));

    const std::string body =
        "film: {resolution: [0, 0]}\nintegrator: {nee: true}\nenvironment: null\n"
        "materials: {red: {type: diffuse, reflectance: 1}, Blue.001: {type: diffuse, reflectance: 1}}\n"
        "objects: [{mesh: " +
        kTriangle + ", material: red}]\n";
    const Scene scene = parse(body, {{"film.resolution", "[12, 34]"},
                                     {"integrator.nee", "false"},
                                     {"sampler.samples", "7"},
                                     {"environment.radiance", "2"},
                                     {"materials.Blue.001.reflectance", "0.25"},
                                     {"objects.0.material", "Blue.001"},
                                     {"objects.0.mesh.positions.1.0", "5"}});
    CHECK(scene.film.height == 34);
    CHECK_FALSE(scene.integrator.nee);
    CHECK(scene.sampler.samples == 7);
    CHECK(scene.environment->radiance == constantSpectrum(2));
    CHECK(scene.objects[0].material == 1);
    CHECK(scene.materials[1].reflectance == constantSpectrum(0.25));
    CHECK(scene.meshes[0].positions[1] == Vec3d{5, 0, 0});
}

TEST_CASE("an override does not leak through an alias", "[scene_yaml][override]") {
    const Scene scene = parse("materials: {a: &m {type: diffuse, reflectance: 1}, b: *m}\n",
                              {{"materials.b.reflectance", "0.5"}});
    CHECK(scene.materials.at(0).reflectance == constantSpectrum(1));
    CHECK(scene.materials.at(1).reflectance == constantSpectrum(0.5));
}

TEST_CASE("errors in overrides name the argument", "[scene_yaml][override][refused]") {
    const std::string body = "materials: {red: {type: diffuse, reflectance: 1}}\nfilm: {filter: box}\n"
                             "objects: [{mesh: " + kTriangle + ", material: red}]\n";
    CHECK(refusedOverride(body, "film.resolutoin=[1,1]") ==
          "--set film.resolutoin: error: unknown key 'resolutoin' in film\n"
          "      | film.resolutoin=[1,1]\n"
          "      |      ^~~~~~~~~~ did you mean 'resolution'?\n"
          "      = keys of film: resolution, crop, filter, color_space, "
          "white_balance, exposure_ev, apply_to_float, spectral, responses, normalise_responses");
    CHECK_THAT(refusedOverride(body, "flim.resolution=[1,1]"),
               Contains("--set flim.resolution: error: unknown key 'flim' in the scene") &&
                   Contains("did you mean 'film'?"));
    CHECK_THAT(refusedOverride(body, "film.resolution=[0,1]"),
               Contains("--set film.resolution: error: value 1 of 'resolution' is 0") &&
                   Contains("\n      | film.resolution=[0,1]\n      |                  ^"));
    CHECK_THAT(refusedOverride(body, "film.resolution=[0,"),
               Contains("--set film.resolution: error: not valid YAML"));
    CHECK_THAT(refusedOverride(body, "film.resolution="),
               Contains("--set film.resolution: error: there is no value after '='"));
    CHECK_THAT(refusedOverride(body, "materials.rde.reflectance=1"),
               Contains("there is no 'rde' in 'materials'") && Contains("did you mean 'red'?"));
    CHECK_THAT(refusedOverride(body, "objects.1.material=red"),
               Contains("'objects' is a list; expected an index from 0 to 0, found '1'"));
    CHECK_THAT(refusedOverride(body, "objects.first.material=red"),
               Contains("expected an index from 0 to 0, found 'first'"));
    CHECK_THAT(refusedOverride("", "outputs.0.file=a.exr"),
               Contains("--set outputs.0.file: error: expected a list for 'outputs', found a map"));
    CHECK_THAT(refusedOverride("outputs: []\n", "outputs.0.file=a.exr"),
               Contains("'outputs' is an empty list"));
    CHECK_THAT(refusedOverride(body, "film.filter.radius=2"),
               Contains("'film.filter' is 'box' here") && Contains("set 'film.filter' as a whole"));
    CHECK(refusal("crt: 1\n", {{"camera.fov", "0"}}).place().file == "--set camera.fov");
}

// ---- Generated documents --------------------------------------------------------------------------------

TEST_CASE("docs/scene.md is what the schema says", "[scene_yaml][docs]") {
    const std::string path = CRT_SOURCE_DIR "/docs/scene.md";
    const std::string text = sceneReferenceMarkdown();
    if (std::getenv("CRT_UPDATE_DOCS") != nullptr) std::ofstream(path, std::ios::binary) << text;
    std::ifstream in(path, std::ios::binary);
    const std::string committed{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    // Not CHECK(a == b): two whole manuals on the terminal help no reader.
    INFO("run this test with CRT_UPDATE_DOCS=1 to write the file");
    CHECK((committed == text));
}

TEST_CASE("the example of the manual is a scene", "[scene_yaml][docs]") {
    const std::string text = sceneReferenceMarkdown();
    const std::size_t begin = text.find("```yaml\n") + 8;
    const Quiet quiet;
    const int before = warningCount();
    const Scene scene =
        parseScene(text.substr(begin, text.find("```", begin) - begin), "docs/scene.md", ".");
    CHECK(scene.objects.size() == 2);
    CHECK(warningCount() == before);
}

TEST_CASE("the JSON Schema knows every key of the table", "[scene_yaml][docs]") {
    const nlohmann::json schema = nlohmann::json::parse(sceneJsonSchema());
    CHECK(schema.at("$schema") == "http://json-schema.org/draft-07/schema#");
    CHECK(schema.at("additionalProperties") == false);
    CHECK(schema.at("required") == nlohmann::json{"crt"});
    for (const SectionSchema& section : sceneSchema()) {
        std::string name = section.name;
        for (char& c : name)
            if (c == '/') c = '-';
        const nlohmann::json& described = name.empty() ? schema : schema.at("definitions").at(name);
        CHECK(described.at("properties").size() == section.keys.size());
        for (const KeySchema& key : section.keys) {
            CHECK(described.at("properties").contains(key.name));
            CHECK_FALSE(key.doc.empty());
            if (key.kind == ValueKind::Section) CHECK_FALSE(schemaVariants(key.section).empty());
        }
    }
    const nlohmann::json& fov = schema.at("definitions").at("camera").at("properties").at("fov");
    CHECK(fov.at("exclusiveMinimum") == 0);
    CHECK(fov.at("exclusiveMaximum") == 180);
}
