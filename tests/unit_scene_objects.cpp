// Scene YAML: meshes, placements, and the materials that an OBJ brings.
#include "scene_texts.h"

#include "base/temporary_folder.h"

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
