// Group K: input hygiene and size. What is wrong is refused by name before anything is rendered, or borne
// and the same image. One of each kind: every refusal has a test of its own (tests/unit_scene_yaml.cpp,
// tests/unit_mesh_io.cpp), and every reader a fuzz target (tests/fuzz).
#include "base/temporary_folder.h"
#include "verify/context.h"

#include "base/error.h"

#include <fmt/format.h>

#include <cmath>
#include <tuple>
#include <utility>

namespace crt::verify {
namespace {

std::string scene(const std::string& object, const std::string& more = "") {
    return fmt::format(
        "crt: 1\ncamera: {{position: [0.3, 0.3, -2], target: [0.3, 0.3, 0], fov: 40}}\nfilm: {{resolution: "
        "[8, 8]}}\n"
        "integrator: {{max_depth: 2, nee: false}}\nenvironment: {{radiance: 1}}\nmaterials: {{m: {{type: "
        "diffuse, reflectance: 0.5}}}}\n"
        "objects: [{{name: a, material: m, {}}}]\n{}",
        object, more);
}

std::string triangle(const std::string& number) {
    return fmt::format("mesh: {{positions: [[0, 0, 0], [{}, 0, 0], [0, 1, 0]], faces: [[0, 1, 2]]}}",
                       number);
}

void numbers(Context& context) {
    for (const auto& [number, words] : {std::pair{".nan", "NaN and infinity have no place"},
                                        {"-.inf", "NaN and infinity have no place"},
                                        {"1e999", "outside the range of a double"},
                                        {"-nan(ind)", "expected a number"},
                                        {"1,5", "3 numbers"},
                                        {"0x1.8p0", "expected a number"},
                                        {"'1'", "leave the quotes out"},
                                        {"one", "expected a number"}})
        context.refused(number, scene(triangle(number)), words);
}

void spellings(Context& context) {
    const std::string plain = scene(triangle("1"));
    const Film film = context.render(plain);
    const auto ask = [&](const char* what, const std::string& text) {
        context.sameBits(what, film, context.render(text), "the spelling of a file reaches the image");
    };
    std::string crlf;
    for (const char c : plain) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    ask("carriage returns", crlf);
    ask("a byte order mark", "\xEF\xBB\xBF" + plain);
    ask("no newline at the end", plain.substr(0, plain.size() - 1));
    ask("numbers spelt otherwise", scene(triangle("1.000e0")));
}

void meshFiles(Context& context) {
    const TemporaryFolder folder;
    int count = 0;
    const auto obj = [&](const std::string& text) {
        return scene(fmt::format("obj: '{}'", folder.write(fmt::format("{}.obj", ++count), text)));
    };
    const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (const auto& [what, text, words] :
         {std::tuple{"a coordinate of NaN", std::string("v 0 0 0\nv nan 0 0\n"), "finite"},
          {"1e999", std::string("v 0 0 1e999\n"), "finite"},
          {"a comma for a point", std::string("v 0 0 1,5\n"), "'1,5'"},
          {"index 0", corners + "f 0 1 2\n", "'0'"},
          {"an index beyond the end", corners + "f 1 2 4\n", "vertex 4, but the file has 3"},
          {"an index before the beginning", corners + "f 1 2 -4\n", "vertex -4, but only 3"},
          {"an index beyond 32 bits", corners + "f 1 2 99999999999999999999\n", "99999999999999999999"},
          {"a face of two corners", corners + "f 1 2\n", "three corners"},
          {"no faces", corners, "no faces"},
          {"nothing", std::string(), "no faces"}})
        context.refused(what, obj(text), words);
    const Film film = context.render(scene(triangle("1")));
    for (const auto& [what, text] :
         {std::pair{"counted from the end", corners + "f -3 -2 -1\n"},
          {"carriage returns", std::string("v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n")},
          {"no newline at the end", corners + "f 1 2 3"},
          {"a byte order mark", "\xEF\xBB\xBF" + corners + "f 1 2 3\n"},
          {"a normal that is not there", corners + "f 1//1 2//1 3//1\n"},
          {"texture coordinates that are not there", corners + "f 1/ 2/ 3/\n"}})
        try {
            context.sameBits(what, film, context.render(obj(text)),
                             "the spelling of a mesh reaches the image");
        } catch (const Error& error) {
            context.holds(what, false, "the same image", "a mesh that others read is refused", error.what());
        }
    // A polygon of a thousand corners: that it is as bright as its area says is asked by the mesh reader's
    // own tests; here, that it is rendered.
    std::string many;
    for (int i = 0; i < 1000; ++i)
        many += fmt::format("v {} {} 0\n", 0.3 + std::cos(i * 6.283185307179586 / 1000),
                            0.3 + std::sin(i * 6.283185307179586 / 1000));
    many += "f";
    for (int i = 1; i <= 1000; ++i) many += fmt::format(" {}", i);
    context.holds("a face of a thousand corners", luminance(context.render(obj(many + "\n"))) > 0,
                  "rendered, not black", "");
}

void keys(Context& context) {
    context.refused("an unknown key", scene(triangle("1"), "flim: {}\n"), "did you mean 'film'?");
    context.refused("a key given twice", scene(triangle("1"), "title: a\ntitle: b\n"), "duplicate key");
    context.refused("a wrong type", scene(triangle("1"), "sampler: 3\n"), "expected a map");
    context.refused("a depth below 0", scene(triangle("1")) + "sampler: {seed: -1}\n", "must be 0 or more");
    context.refused("not YAML", "crt: 1\nfilm: {resolution: [4, 4\n", "case.yaml");
    context.refused("nothing", "", "there is nothing in this file");
}

void files(Context& context) {
    const TemporaryFolder folder;
    context.refused("a mesh that is not there", scene("obj: none-such.obj"), "none-such.obj");
    context.refused("a directory for a mesh", scene(fmt::format("obj: '{}'", folder.path())), "directory");
    const std::string other = folder.write("other.yaml", "include: one.yaml\n");
    folder.write("one.yaml", "include: other.yaml\n");
    context.refused("scenes that include each other",
                    fmt::format("include: '{}'\n", other) + scene(triangle("1")), "a cycle has no end");
    context.notApplicable("disk full at write", "asked of the program from outside: tests/cli; exit code 6");
}

void filmSizes(Context& context) {
    const auto film = [](const char* resolution) {
        return fmt::format(
            "crt: 1\ncamera: {{position: [0, 0, 0], target: [0, 0, 1], fov: 40}}\nfilm: {{resolution: "
            "{}}}\nenvironment: {{radiance: 1}}\n",
            resolution);
    };
    context.refused("a film of 0 pixels", film("[0, 4]"), "must be 1 to 65535");
    context.refused("a film of 2^32 pixels", film("[65535, 65535]"), "at most 2^31");
    context.refused(
        "an index that 32 bits cannot hold",
        scene("mesh: {positions: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces: [[0, 1, 4294967296]]}"),
        "4294967296");
    context.notApplicable("more than 2^28 triangles, more than 64 GiB",
                          "refused by counts that are made in 64 bits before memory is asked for "
                          "(core/compile/flatten.cpp, core/compile/blob_writer.h); "
                          "a scene that large fits no test");
}

}  // namespace

std::vector<Case> inputCases() {
    const auto spelling = [](const char* id, const char* case_name, const char* title, const char* expected,
                             void (*run)(Context&)) {
        return row(id, case_name, title, expected, "docs/scene.md",
                   "the message; same bits where it is borne", Level::Commit, 0, run);
    };
    return {
        spelling("K01", "numbers", "NaN, infinity, 1e999, -nan(ind), commas, hexadecimal, quotes",
                 "refused by place", numbers),
        spelling("K02", "spellings", "CRLF, byte order mark, no last newline", "the same image", spellings),
        spelling("K03", "mesh-files", "OBJ: numbers, indices, corners, missing normals; other spellings",
                 "refused by line; the same image", meshFiles),
        spelling("K04", "keys", "Unknown, doubled and wrong keys; no YAML; nothing", "refused by place",
                 keys),
        spelling("K05", "files", "Meshes that are missing or directories; scenes that include each other",
                 "refused by name", files),
        spelling("K06", "sizes", "Films of 0 and 2^32 pixels, indices beyond 32 bits",
                 "refused before memory is asked for", filmSizes),
    };
}

}  // namespace crt::verify
