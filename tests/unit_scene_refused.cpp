// Scene YAML: for every kind of mistake the message names place, reason and remedy.
//
// Over 450 lines: one kind of mistake after the other.
#include "scene_texts.h"

#include "base/temporary_folder.h"

#include <cmath>
#include <fstream>

using namespace crt;
using namespace crt::test;

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
    CHECK_THROWS_WITH(loadScene(folder.write("a.xml", "<scene/>")),
                      Contains("a.xml: error: this is a scene of Mitsuba; crt's Python package converts"));
    CHECK_THROWS_WITH(loadScene(folder.write("a.pbrt.gz", "\x1f\x8b")), Contains("a scene of pbrt; crt's"));
}

TEST_CASE("texts that are not YAML, or not the YAML of a scene", "[scene_yaml][refused]") {
    CHECK_THAT(refused("film: {resolution: [1, 2}\n"), Contains("scene.yaml:2:25: error: not valid YAML"));
    CHECK_THAT(refused("camera:\n\tfov: 3\n"),
               Contains("scene.yaml:3:5: error: not valid YAML") && Contains("indent with spaces"));
    CHECK_THAT(refused("title: *nowhere\n"),
               Contains("scene.yaml:2:8: error: not valid YAML: the referenced anchor is not defined"));
    CHECK_THAT(refusal("- 1\n- 2\n").what(),
               Contains("scene.yaml:1:1: error: expected a map for the scene, found a list of 2"));
    CHECK_THAT(refusal("~").what(), Contains("expected a map for the scene, found nothing"));
    CHECK_THAT(refused("---\ncrt: 1\n"),
               Contains("scene.yaml:2:1: error: a second YAML document begins here"));
    CHECK_THAT(refused("title: !!str x\n"),
               Contains("error: a scene has no YAML tags; remove 'tag:yaml.org,2002:str'"));
    CHECK_THAT(refused("? [1, 2]\n: 3\n"),
               Contains("scene.yaml:2:3: error: a list as a key is not possible here"));
    CHECK_THAT(refused("title: " + std::string(3000, '[') + "\n"),
               Contains("nested more than 64 levels deep"));
    CHECK_THAT(refused("objects: &a [{name: x, transforms: *a}]\n"),
               Contains("scene.yaml:2:36: error: this alias is inside its own value"));
    CHECK_THAT(refused("film: {<<: {resolution: [1, 1]}}\n"),
               Contains("scene.yaml:2:8: error: merge keys ('<<') are not part of a scene"));

    std::string laughs = "spectra:\n  a: &a [x, x, x, x, x, x, x, x, x, x]\n";
    for (char c = 'b'; c <= 'k'; ++c) {
        laughs += std::string("  ") + c + ": &" + c + " [";
        for (int i = 0; i < 10; ++i) laughs += std::string(i > 0 ? ", *" : "*") + static_cast<char>(c - 1);
        laughs += "]\n";
    }
    CHECK_THAT(refused(laughs),
               Contains("values behind aliases, which need") && Contains("set CRT_SCENE_MEMORY="));
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
          "      = keys of a diffuse material: type, reflectance, roughness, normal_map, "
          "opacity");
    CHECK_THAT(refused("flim: {}\n"), Contains("scene.yaml:2:1: error: unknown key 'flim' in the scene") &&
                                          Contains("did you mean 'film'?"));
    CHECK_THAT(refused("nee: false\n"),
               Contains("unknown key 'nee' in the scene") && Contains("'nee' is a key of integrator"));
    CHECK_THAT(refused("path: {nee: false}\n"), Contains("unknown key 'path' in the scene"));
    CHECK_THAT(refused("title: a\ntitle: b\n"),
               Contains("scene.yaml:3:1: error: duplicate key 'title', already given in line 2"));
    CHECK_THAT(refused("materials: {a: {type: difuse}}\n"),
               Contains("scene.yaml:2:23: error: expected one of diffuse, translucent, mirror, conductor, "
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
    CHECK_THAT(refused("objects: [{material: m}]\n"),
               Contains("object 0 needs obj or ply or stl or gltf or mesh or"));
}

TEST_CASE("columns count characters, not bytes", "[scene_yaml][refused]") {
    const Error e = refusal("crt: 1\nmaterials: {grün: {refl: 1}}\n");
    CHECK_THAT(e.what(), Contains("scene.yaml:2:19: error: 'type' is missing in material 'grün': one of "
                                  "diffuse, translucent, mirror, conductor, rough_conductor, dielectric, "
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
               Contains("expected one of path, normals, aabb, splat_test for 'type', found 'pth'") &&
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
    CHECK_THAT(refused("spectra: {0.5: 1}\n"), Contains("'0.5' cannot be the name of a spectrum"));
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
               Contains("a uniform thickness") && Contains("use a dielectric"));
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: 1.5, thin_film: {thickness_nm: 300, "
                       "ior: 1.3, relative_thickness: {checker: [0, 1]}}}}\n"
                       "objects: [{mesh: {positions: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "
                       "faces: [[0, 1, 2]]}, material: m}]\n"),
               Contains("has a texture, but the mesh of object 0 has no texture coordinates"));
    CHECK_THAT(refusedMaterial("{type: rough_conductor, metal: Al, roughness: 0.5, anisotropy: 0.5}"),
               Contains("unknown key 'anisotropy'"));
    CHECK_THAT(refusedMaterial("{type: rough_conductor, metal: Al, roughness: {checker: [0, 1]}, "
                               "roughness_anisotropy: 0.5}"),
               Contains("a uniform roughness") && Contains("give 'roughness' a number"));
    CHECK_THAT(refusedMaterial("{type: rough_dielectric, ior: 1.5, roughness: 0.5, "
                               "roughness_anisotropy: 0.5, thin_film: {thickness_nm: 300, ior: 1.3}}"),
               Contains("must be isotropic") && Contains("leave 'thin_film'"));
    const auto refusedOpenPbr = [&](const std::string& keys) {
        return refusedMaterial("{type: openpbr, " + keys + "}");
    };
    for (const auto& [keys, why, instead] :
         {std::tuple{"subsurface_weight: 1", "subsurface scattering", "remove 'subsurface_weight'"},
          std::tuple{"subsurface_weight: 1, geometry_thin_walled: true, coat_weight: 1",
                     "a coat on what lets light through", "leave 'coat_weight'"},
          std::tuple{"transmission_weight: 1, geometry_thin_walled: true", "must be smooth", "ness' 0"},
          std::tuple{"coat_weight: 0.5, transmission_weight: 0.5", "coats lie on what is opaque",
                     "leave 'coat_weight'"},
          std::tuple{"coat_weight: {checker: [0, 1]}, coat_ior: 0.9", "an index of 1 to 10", "from 1 to 10"},
          std::tuple{"coat_weight: 1, coat_ior: 11", "an index of 1 to 10", "from 1 to 10"},
          std::tuple{"coat_weight: 1, coat_roughness: 0.5, coat_roughness_anisotropy: 0.5",
                     "must be isotropic", "leave 'coat_roughness_anisotropy'"},
          std::tuple{"coat_weight: 1, emission_luminance: 1", "the coat would take", "leave 'coat_weight'"},
          std::tuple{"coat_weight: 1, specular_ior: 17", "must be 1 to 10", "of at least 1"},
          std::tuple{"fuzz_weight: 1, emission_luminance: 1", "take some of the emitted light",
                     "leave 'fuzz_weight'"},
          std::tuple{"base_metalness: 1, specular_weight: 2", "more light than it receives", "1 or less"},
          std::tuple{"specular_color: 0.5, transmission_weight: 0.5", "for what is opaque only",
                     "leave 'specular_color'"},
          std::tuple{"specular_color: {checker: [0, 1]}, base_metalness: 0.5", "a uniform 'specular_color'",
                     "give a colour"},
          std::tuple{"specular_roughness_anisotropy: 0.5", "must be isotropic", "leave it out"},
          std::tuple{"specular_ior: 0.9", "must be 1 to 10", "of at least 1"},
          std::tuple{"transmission_weight: 1, transmission_color: 0.5", "tint the surface itself",
                     "give 'transmission_depth'"},
          std::tuple{"transmission_weight: 1, transmission_color: 0, transmission_depth: 1", "opaque",
                     "above 0"},
          std::tuple{"thin_film_weight: 1", "films on clear dielectrics", "'transmission_weight' 1"},
          std::tuple{"base_metalness: 1, specular_roughness: {checker: [0, 1]}, "
                     "specular_roughness_anisotropy: 1",
                     "a uniform roughness", "a number"},
          std::tuple{"transmission_weight: 1, transmission_color: 0.5, transmission_depth: 1, "
                     "geometry_opacity: 0.5",
                     "closed", "leave 'geometry_opacity'"}}) {
        INFO(keys);
        CHECK_THAT(refusedOpenPbr(keys), Contains(why) && Contains(instead));
    }
    // Of slabs that are not there keys may say anything.
    CHECK_NOTHROW(parse("materials: {m: {type: openpbr, base_metalness: 1, base_diffuse_roughness: 1, "
                       "transmission_color: 0.5, specular_color: 0.5}}\n"));
    CHECK_NOTHROW(parse("materials: {m: {type: openpbr, transmission_weight: 1, emission_luminance: 1, "
                       "coat_ior: 0.5, coat_roughness: 1, coat_roughness_anisotropy: 1}}\n"));
    CHECK_NOTHROW(parse("materials: {m: {type: openpbr, coat_weight: 1, coat_roughness_anisotropy: 1, "
                       "base_metalness: 1, specular_roughness: {checker: [0, 1]}, "
                       "transmission_weight: 1}}\n"));
    // Under a coat of its own index there is no gloss, whose roughness would be seen.
    CHECK_NOTHROW(
        parse("materials: {m: {type: openpbr, coat_weight: 1, coat_ior: 1.5, "
              "base_diffuse_roughness: 0.5, specular_roughness: {checker: [0, 1]}}}\n"));
    CHECK_THAT(refusedOpenPbr("coat_weight: 0.5, coat_ior: 1.5, base_diffuse_roughness: 0.5, "
                              "specular_roughness: {checker: [0, 1]}"),
               Contains("a gloss of uniform roughness"));
    const std::string lamp = "materials: {m: {type: openpbr, emission_luminance: 1}, "
                             "t: {type: two_sided, front: m, back: m}}\n";
    CHECK_THAT(refused(lamp), Contains("cannot emit light") && Contains("give the object"));
    CHECK_THAT(refused("materials: {m: {type: openpbr, emission_luminance: 1}}\nobjects:\n"
                       "  - {mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}, material: m,"
                       " emission: {radiance: 1}}\n"),
               Contains("emits light already") && Contains("leave 'emission'"));
    CHECK_THAT(refusedOpenPbr("emission_luminance: -1"), Contains("'emission_luminance'"));
    CHECK_THAT(refusedOpenPbr("coat_colour: 1"), Contains("unknown key 'coat_colour'"));
    CHECK_THAT(refusedOpenPbr("coat_weight: 1.5"), Contains("'coat_weight'"));
    CHECK_THAT(refusedOpenPbr("coat_color: 2"), Contains("'coat_color'"));
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
               Contains("only an OBJ has its own materials"));
    CHECK_THAT(refused(meshScene("mesh: {positions: [[0, 0, 0]], faces: [[0, 0, 1]]}")),
               Contains("face 0 uses position 1, but there are only 1"));
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
               Contains("is not invertible"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle +
                                 ", transform: [{matrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]}]")),
               Contains("the last row must be 0 0 0 1"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transform: [{scale: 1e200}, {scale: 1e200}]")),
               Contains("overflows"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", transforms: []")),
               Contains("an object without placements is invisible"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", emission: {radiance: -2}")),
               Contains("'radiance' of the emission of object 0 is -2; it must be 0 to 1e+25"));
    CHECK_THAT(refused(meshScene("mesh: " + kTriangle + ", emission: {radiance: .nan}")), Contains("NaN"));
}

TEST_CASE("outputs that cannot be", "[scene_yaml][refused]") {
    CHECK_THAT(
        refused("outputs: [{file: a.pgn}]\n"),
        Contains("2:18: error: 'a.pgn' does not end in .exr, .png, .jpg, .ppm or .pfm; add 'format'") &&
            Contains("did you mean 'png'?"));
    CHECK(parse("outputs: [{file: a.JPG}]\n").outputs[0].format == OutputFormat::Jpeg);
    CHECK_THAT(refused("outputs: [{file: a.png, aovs: [depth]}]\n"),
               Contains("only exr files can hold AOVs"));
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
