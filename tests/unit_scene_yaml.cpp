// Scene YAML: what good scenes become, what overrides change, and the documents that come of the schema.
//
// Over 450 lines: every kind of value once.
#include "scene_texts.h"

#include "base/temporary_folder.h"
#include "film/film.h"
#include "film/resolve.h"
#include "scene/aov.h"
#include "scene/yaml/scene_schema.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

using namespace crt;
using namespace crt::test;

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
    CHECK(written == 31);

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
    CHECK(a.film.view == b.film.view);
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
                                              {"aabb", IntegratorType::Aabb},
                                              {"splat_test", IntegratorType::SplatTest}},
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
                                            {"jpeg", OutputFormat::Jpeg},
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
                                             {"error", kAovError}, {"color_error", kAovColorError}},
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

        // Read from the scene, resolved from a film that has what the scene needs: the channels that the row
        // names, and no others.
        std::uint32_t in_film = output.aovs & (kAovsOfFirstHits | kAovColorError);
        if (in_film == kAovColorError) in_film |= kAovReplicates;
        const Image image =
            resolveImage(Film({2, 1, channelsFor(in_film), in_film}), Development{}, output.aovs);
        std::vector<std::string> channels = {"R", "G", "B"};
        const std::vector<std::string> own = exrNames(row);
        CHECK_FALSE(own.empty());
        if (!row.integer) channels.insert(channels.end(), own.begin(), own.end());
        // Output of noise comes with the planes that make it usable in other ways.
        if (row.aov == kAovError) channels.emplace_back("HalfWidth95.Y");
        if (row.aov == kAovError || row.aov == kAovVariance) channels.emplace_back("OwnVariance.Y");
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
               Contains("scene.yaml:2:32: error") && Contains("add 'outside: clamp' or 'outside: zero'"));
    folder.write("broken.spd", "400 1\n500 x\n");
    CHECK_THAT(refused("environment: {radiance: {file: broken.spd, outside: zero}}", {}, folder.path()),
               Contains("scene.yaml:2:32: error") && Contains("broken.spd:2"));
    CHECK_THAT(refused("environment: {radiance: {file: lmap.spd, outside: zero}}", {}, folder.path()),
               Contains("scene.yaml:2:32: error: cannot find 'lmap.spd'; searched in " + folder.path()) &&
                   Contains("did you mean 'lamp.spd'?"));
    for (const char* outside : {"", ", outside: clamp", ", outside: zero"})
        CHECK_THAT(refusedReflectance(std::string("{table: {nm: [0.4, 0.7], value: [0, 1]}") + outside +
                                      "}"),
                   Contains("scene.yaml:3:48: error: wavelengths must be in nm, but these go from 0.4 to") &&
                       Contains("are these micrometres?"));
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
          "white_balance, exposure_ev, apply_to_float, view, spectral, responses, normalise_responses");
    CHECK_THAT(refusedOverride(body, "flim.resolution=[1,1]"),
               Contains("--set flim.resolution: error: unknown key 'flim' in the scene") &&
                   Contains("did you mean 'film'?"));
    CHECK_THAT(refusedOverride(body, "film.resolution=[0,1]"),
               Contains("--set film.resolution: error: value 1 of 'resolution' is 0") &&
                   Contains("\n      | film.resolution=[0,1]\n      |                  ^"));
    CHECK_THAT(refusedOverride(body, "film.resolution=[0,"),
               Contains("--set film.resolution: error: not valid YAML"));
    CHECK_THAT(refusedOverride(body, "film.resolution="),
               Contains("--set film.resolution: error: the value after '=' is missing"));
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
