// Scene YAML: meshes, placements, and the materials that an OBJ brings.
#include "gltf_file_maker.h"
#include "scene_texts.h"

#include "base/temporary_folder.h"
#include "captured_log.h"
#include "compile/compile.h"

#include <cmath>
#include <fstream>

using namespace crt;
using namespace crt::test;

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

// For every source of the mesh and every option.
TEST_CASE("an object whose mesh has no face of an area is left out with a warning", "[scene_yaml]") {
    const TemporaryFolder folder;
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    folder.write("lamp.obj", "mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 2 0 0\nusemtl lamp\nf 1 2 3\n");
    folder.write("lamp.mtl", "newmtl lamp\nKd 0 0 0\nKe 1 1 1\n");
    folder.write(
        "flat.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
        "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n2 0 "
        "0\n3 0 1 2\n");
    GltfMaker maker;
    const int points = maker.points({0, 0, 0, 1, 0, 0, 2, 0, 0});
    maker.node({{"mesh", maker.mesh({{"attributes", {{"POSITION", points}}}})}});
    folder.write("flat.glb", maker.glb());
    for (const std::string mesh :
         {"obj: flat.obj, material: grey", "obj: lamp.obj", "obj: flat.obj, material: grey, normals: smooth",
          "ply: flat.ply, material: grey", "ply: flat.ply, material: grey, normals: smooth",
          "gltf: {file: flat.glb, mesh: 0}, material: grey",
          "mesh: {positions: [[0,0,0],[1,0,0],[2,0,0]], faces: [[0,1,2]]}, material: grey"})
        for (const std::string emission : {"", ", emission: {radiance: 1}"}) {
            INFO(mesh << emission);
            const CapturedLog log;
            const Scene scene = parseScene("crt: 1\n" + kGrey + "objects: [{name: gone, " + mesh + emission +
                                               "}, {name: also, " + mesh + emission +
                                               "}, {mesh: " + kTriangle + ", material: grey}]",
                                           "scene.yaml", folder.path());
            REQUIRE(scene.objects.size() == 1);
            CHECK(scene.objects[0].name == "object 2");
            CHECK_THAT(log.text(), Contains("object 'gone' is left out") && Contains("object 'also' is") &&
                                       Contains("no face of its mesh has an area"));
            CHECK((log.text().find("and its light with it") != std::string::npos) == !emission.empty());
            (void)compileScene(scene, 0);
        }
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
        parse(kGrey + "objects: [{obj: two.obj, parts: {Lamp.001: {material: grey}}}]", {}, folder.path());
    CHECK(replaced.materials.size() == 2);
    CHECK(replaced.meshes.at(0).material == std::vector<std::int32_t>{1, 0});
    CHECK(replaced.meshes[0].emission.empty());

    const Scene ignored =
        parse(kGrey + "objects: [{obj: two.obj, material: grey, override: true}]", {}, folder.path());
    CHECK(ignored.meshes.at(0).material.empty());
    CHECK(ignored.materials.size() == 1);
    CHECK(ignored.objects.at(0).material == 0);

    CHECK_THAT(
        refused(kGrey + "objects: [{obj: two.obj, parts: {Lmap.001: {material: grey}}}]", {}, folder.path()),
        Contains("scene.yaml:3:34: error: no face of 'two.obj' belongs to a group, object or material "
                 "'Lmap.001'") &&
            Contains("did you mean 'Lamp.001'?") && Contains("its faces have 'body', 'Lamp.001'"));
    CHECK_THAT(refused("objects: [{obj: two.obj, override: true}]", {}, folder.path()),
               Contains("name one with 'material:'"));
    CHECK_THAT(refused("objects: [{obj: two.obj, material: from_mtl, override: true}]", {}, folder.path()),
               Contains("name one with 'material:'"));
    for (const char* key : {"override: true", "mtl: {color: srgb}", "parts: {a: {material: grey}}"})
        CHECK_THAT(
            refused(fmt::format("{}objects: [{{mesh: {}, material: grey, {}}}]\n", kGrey, kTriangle, key)),
            Contains("only an OBJ has"));
}

TEST_CASE("parts of an OBJ have materials and emission by group, object or material",
          "[scene_yaml][parts]") {
    const TemporaryFolder folder;
    folder.write("lamp.mtl", "newmtl brass\nKd 0.5 0.4 0.1\nnewmtl glow\nKd 0 0 0\nKe 2 2 2\n");
    folder.write("lamp.obj",
                 "mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no stand\ng foot\nusemtl brass\nf 1 2 "
                 "3\ng lamp shade\nf 1 2 3\no bulb\ng\nusemtl glow\nf 1 2 3\ng foot\nf 1 2 3 1\n");
    const std::string grey =
        "materials: {a: {type: mirror, reflectance: 0.5}, b: {type: diffuse, reflectance: "
        "0.5}, c: {type: diffuse, reflectance: 0.1}}\n";
    // Names of the scene's materials by triangle; those that emit have a mark: *7 by a part, *2 by Ke.
    const auto partsOf = [&](const std::string& parts, const std::string& keys = "material: c, ") {
        const Scene scene =
            parse(fmt::format("{}objects: [{{obj: lamp.obj, {}parts: {{{}}}}}]", grey, keys, parts), {},
                  folder.path());
        const Mesh& mesh = scene.meshes.at(0);
        std::string text;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const std::int32_t m =
                mesh.material.empty() || mesh.material[t] < 0 ? scene.objects[0].material : mesh.material[t];
            const std::int32_t e = emissionIndexOf(scene, scene.objects[0], t);
            text += scene.materials.at(static_cast<std::size_t>(m)).name;
            if (e >= 0)
                text += scene.emissions.at(static_cast<std::size_t>(e)).radiance == constantSpectrum(7)
                            ? "*7"
                            : "*2";
            text += ' ';
        }
        return text;
    };
    const std::string light = "emission: {radiance: 7}";
    CHECK(partsOf("foot: {material: a}") == "c a lamp.obj:brass lamp.obj:glow*2 a ");
    CHECK(partsOf("stand: {material: a}") == "c a a lamp.obj:glow*2 lamp.obj:glow*2 ");
    CHECK(partsOf("lamp shade: {material: a}") == "c lamp.obj:brass a lamp.obj:glow*2 lamp.obj:glow*2 ");
    // A statement may name several groups.
    CHECK(partsOf("shade: {material: a}") == "c lamp.obj:brass a lamp.obj:glow*2 lamp.obj:glow*2 ");
    CHECK(partsOf("brass: {material: a}") == "c a a lamp.obj:glow*2 lamp.obj:glow*2 ");
    CHECK(partsOf("default: {material: a}") == "c lamp.obj:brass lamp.obj:brass a lamp.obj:glow*2 ");
    // Emission of the file's material stops with it, unless the part emits.
    CHECK(partsOf("bulb: {material: a}") == "c lamp.obj:brass lamp.obj:brass a a ");
    CHECK(partsOf("bulb: {" + light + "}") ==
          "c lamp.obj:brass lamp.obj:brass lamp.obj:glow*7 lamp.obj:glow*7 ");
    CHECK(partsOf("shade: {material: a, " + light + "}") ==
          "c lamp.obj:brass a*7 lamp.obj:glow*2 lamp.obj:glow*2 ");
    // The last part that says it, for material and emission each.
    CHECK(partsOf("foot: {material: a}, bulb: {material: b}") == "c a lamp.obj:brass b b ");
    CHECK(partsOf("bulb: {material: b}, foot: {material: a}") == "c a lamp.obj:brass b a ");
    CHECK(partsOf("bulb: {material: b, " + light + "}, foot: {material: a}") ==
          "c a lamp.obj:brass b*7 a*7 ");
    // Patterns
    CHECK(partsOf("'*': {material: b}, 'f?ot': {material: a}") == "c a b b a ");
    CHECK(partsOf("'*am*sh*e': {material: a}") == "c lamp.obj:brass a lamp.obj:glow*2 lamp.obj:glow*2 ");
    // By what has the name
    CHECK(partsOf("'*a*': {by: material, material: a}") == "c a a lamp.obj:glow*2 lamp.obj:glow*2 ");
    CHECK(partsOf("'*a*': {by: object, material: a}") == "c a a lamp.obj:glow*2 lamp.obj:glow*2 ");
    CHECK(partsOf("'*a*': {by: group, material: a}") == "c lamp.obj:brass a a lamp.obj:glow*2 ");
    // Instead of the file's materials
    CHECK(partsOf("foot: {material: a}", "material: c, override: true, ") == "c a c c a ");
    // Nothing of the file is left that no face has.
    CHECK(parse(grey + "objects: [{obj: lamp.obj, material: c, parts: {'*': {material: a}}}]", {},
                folder.path())
              .materials.size() == 3);

    const auto wrong = [&](const std::string& parts) {
        return refused(grey + "objects: [{obj: lamp.obj, material: c, parts: {" + parts + "}}]", {},
                       folder.path());
    };
    CHECK_THAT(
        wrong("stnad: {material: a}"),
        Contains("scene.yaml:3:48: error: no face of 'lamp.obj' belongs to a group, object or material "
                 "'stnad'") &&
            Contains("did you mean 'stand'?") &&
            Contains("its faces have 'brass', 'foot', 'stand', 'lamp shade', 'glow', 'default', 'bulb'"));
    CHECK_THAT(wrong("foot: {by: material, material: a}"),
               Contains("no face of 'lamp.obj' belongs to a material 'foot'"));
    CHECK_THAT(wrong("foot: {material: d}"), Contains("there is no material 'd'"));
    CHECK_THAT(wrong("foot: a"), Contains("expected a map such as {material: NAME}"));
    CHECK_THAT(wrong("foot: {by: group}"), Contains("part 'foot' of object 0 has no effect"));
    CHECK_THAT(wrong("foot: {color: a}"), Contains("unknown key 'color' in part 'foot' of object 0"));
    CHECK_THAT(wrong("foot: {material: a}, 'b*x': {material: a}"), Contains("'b*x'"));
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
    const Scene named =
        parse(kGrey +
                  "objects: [{obj: some.obj, material: grey, parts: {(null): {material: grey}, body: "
                  "{material: grey}}}]",
              {}, folder.path());
    CHECK(named.meshes.at(0).material == std::vector<std::int32_t>{-1, 0, 0});
    CHECK(named.meshes[0].emission.empty());
    CHECK_THAT(refused(kGrey + "objects: [{obj: some.obj}]", {}, folder.path()),
               Contains("2 of 3 triangles of object 0 have no material"));
    CHECK_THAT(
        refused(kGrey + "objects: [{obj: some.obj, parts: {(null): {material: grey}}}]", {}, folder.path()),
        Contains("1 of 3 triangles of object 0 have no material"));
    CHECK_THAT(saidOf(kGrey + "objects: [{obj: some.obj, material: grey}]", folder.path()),
               !Contains("has no face without a material"));

    folder.write("all.obj", "mtllib some.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl body\nf 3 2 1\n");
    CHECK(parse(kGrey + "objects: [{obj: all.obj, material: grey}]", {}, folder.path())
              .meshes.at(0)
              .material == std::vector<std::int32_t>{1});
    CHECK_THAT(saidOf(kGrey + "objects: [{obj: all.obj, material: grey}]", folder.path()),
               Contains("scene.yaml:3:36: object 0 has no face without a material, so 'grey' is unused; "
                        "'override: true' replaces all materials of the OBJ"));
}

TEST_CASE("an OBJ whose MTL is missing needs a material, and says which file is missing",
          "[scene_yaml][mtl]") {
    const TemporaryFolder folder;
    folder.write("lost.obj", "mtllib lost.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl body\nf 3 2 1\n");
    CHECK_THAT(refused(kGrey + "objects: [{obj: lost.obj}]", {}, folder.path()),
               Contains("1 of 1 triangles of object 0 have no material (the OBJ refers to 'lost.mtl', which "
                        "does not exist); give them one with 'material: NAME'"));
    CHECK(parse(kGrey + "objects: [{obj: lost.obj, material: grey}]", {}, folder.path())
              .meshes.at(0)
              .material == std::vector<std::int32_t>{-1});
    CHECK(parse(kGrey + "objects: [{obj: lost.obj, parts: {body: {material: grey}}}]", {}, folder.path())
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
