// Scene YAML: values just outside their bounds, and spellings of one scene.
#include "compiled_scenes.h"
#include "scene_texts.h"

#include <string>
#include <tuple>
#include <utility>

using namespace crt;
using namespace crt::test;

TEST_CASE("numbers that are none are refused in positions", "[scene_yaml][refused]") {
    for (const auto& [number, words] : {std::pair{".nan", "NaN and infinity have no place"},
                                        {".inf", "NaN and infinity have no place"},
                                        {"-.inf", "NaN and infinity have no place"},
                                        {"1e999", "outside the range of a double"},
                                        {"-nan(ind)", "expected a number"},
                                        {"0x1.8p0", "write it in decimal"},
                                        {"1,5", "expected a list of 3 numbers"},
                                        {"'1'", "leave the quotes out"}}) {
        INFO(number);
        const std::string place = std::string("[0, ") + number + ", 0]";
        CHECK_THAT(refused("camera: {position: " + place + "}\n"), Contains(words));
        CHECK_THAT(refused(kGrey + "objects: [{material: grey, mesh: {positions: [[0, 0, 0], [1, 0, 0], " +
                           place + "], faces: [[0, 1, 2]]}}]\n"),
                   Contains(words));
    }
    CHECK_THAT(refused("camera: {fov: .nan}\n"), Contains("NaN and infinity have no place"));
    CHECK_THAT(refused(kGrey + "objects: [{material: grey, emission: {radiance: .inf}, mesh: " + kTriangle +
                       "}]\n"),
               Contains("NaN and infinity have no place"));
}

TEST_CASE("values just outside their bounds are refused", "[scene_yaml][refused]") {
    for (const auto& [text, words] : {
             std::pair{"camera: {fov: -10}", "'fov' is -10; it must be between 0 and 180"},
             {"camera: {fov: 360}", "'fov' is 360; it must be between 0 and 180"},
             {"film: {resolution: [46341, 46341]}", "2147488281 pixels; a film has at most 2^31"},
             {"film: {resolution: [65536, 1]}", "value 1 of 'resolution' is 65536; it must be 1 to 65535"},
             {"integrator: {max_depth: 2147483647}", "it must be 0 to 1000000000"},
         }) {
        INFO(text);
        CHECK_THAT(refused(std::string(text) + "\n"), Contains(words));
    }
    for (const auto& [material, words] : {
             std::pair{"{type: diffuse, reflectance: 1.0000001}", "is 1.0000001; it must be 0 to 1"},
             {"{type: diffuse, reflectance: 1, roughness: 2}", "'roughness' is 2; it must be 0 to 1"},
             {"{type: mirror, reflectance: 1, opacity: 1.1}", "'opacity' is 1.1; it must be 0 to 1"},
             {"{type: rough_conductor, metal: Ag, roughness: 1.5}", "'roughness' is 1.5; it must be 0 to 1"},
             {"{type: rough_conductor, metal: Ag, roughness: 0.5, roughness_anisotropy: 1.5}",
              "'roughness_anisotropy' is 1.5; it must be 0 to 1"},
             {"{type: rough_dielectric, ior: 1.5, roughness: -0.1}",
              "'roughness' is -0.1; it must be 0 to 1"},
             {"{type: plastic, reflectance: 1, ior: 0.5}", "'ior' is 0.5; it must be 1 to 10"},
             // Beyond, 1/n² is below what single precision tells from total reflection.
             {"{type: dielectric, ior: 10000}", "is 10000; it must be 0.001 to 1000"},
             {"{type: dielectric, ior: 1.5, thin_film: {thickness_nm: -1, ior: 1.3}}",
              "'thickness_nm' is -1; it must be 0 to"},
             {"{type: dielectric, ior: 1.5, absorption: 1, opacity: .5}", "body must be closed"},
             {"{type: diffuse, reflectance: {table: {nm: [0, 500], value: [1, 1]}, outside: clamp}}",
              "value 1 of 'nm' is 0; it must be above 0"},
         }) {
        INFO(material);
        CHECK_THAT(refused(std::string("materials: {m: ") + material + "}\n"), Contains(words));
    }
    CHECK_THAT(refused(kGrey + "objects: [{material: grey, mesh: {positions: [[0, 0, 0], [1, 0, 0], "
                               "[0, 1, 0]], faces: [[0, 1, 4294967296]]}}]\n"),
               Contains("an index of face 0 is 4294967296"));
}

TEST_CASE("the spelling of a scene file does not reach what is compiled", "[scene_yaml][compile]") {
    const auto compiledFrom = [](const std::string& text) {
        const Quiet quiet;
        return compileScene(parseScene(text, "scene.yaml", ".", {}), 0);
    };
    const std::string before =
        "crt: 1\ncamera: {position: [0.3, 0.3, -2], target: [0.3, 0.3, 0], fov: 40}\n"
        "film: {resolution: [8, 8]}\nenvironment: {radiance: 1}\n" +
        kGrey + "objects: [{material: grey, mesh: {faces: [[0, 1, 2]], positions: [[0, 0, 0], [0, 1, 0], [";
    const std::string after = ", 0, 0]]}}]\n", plain = before + "1" + after;
    std::string windows;
    for (const char c : plain) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
    const CompiledScene expected = compiledFrom(plain);
    for (const std::string& text :
         {windows, "\xEF\xBB\xBF" + plain, plain.substr(0, plain.size() - 1), before + "1.000e0" + after}) {
        INFO(text);
        CHECK(compile_test::sameBytes(compiledFrom(text), expected));
    }
    CHECK_FALSE(compile_test::sameBytes(compiledFrom(before + "1.5" + after), expected));
}
