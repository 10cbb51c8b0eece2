// Scene → blob: where the author's lengths and sides go, what materials and lights come out, and that all
// of it lies within the blob.
#include "compiled_scenes.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

using namespace compile_test;

TEST_CASE("a mirroring transform keeps the outside outside, for faces and shading normals", "[compile]") {
    for (const Vec3d& scale :
         {Vec3d{1, 1, 1}, Vec3d{-1, 1, 1}, Vec3d{2, -3, 1}, Vec3d{-1, -2, 0.5}, Vec3d{-1, -2, -0.3}}) {
        Scene scene = litFloor();
        scene.meshes[0] = smoothTetrahedron();
        scene.objects.resize(1);
        scene.objects[0].emission = 0;
        // Scale, then shear, then move.
        scene.objects[0].transforms = {{scale[0], 0.3 * scale[1], 0, 4, 0, scale[1], -0.2 * scale[2], 5, 0,
                                        0, scale[2], 6, 0, 0, 0, 1}};
        const CompiledScene c = compiled(scene);
        const CrtContext ctx = contextOf(c);
        const auto triangles = listOf<CrtTriangle>(c, ctx.scene->triangles);
        const auto faces = listOf<CrtFace>(c, ctx.scene->faces);
        const auto primitives = listOf<CrtPrimitive>(c, ctx.scene->primitives);
        const auto normals = listOf<CrtNormals>(c, ctx.scene->normals);
        REQUIRE(triangles.size() == 4);
        Vec3d middle{};  // inside
        for (const CrtTriangle& t : triangles)
            for (u32 v = 0; v < 3; ++v)
                middle = plus(middle, times(toDouble(crt_triangle_vertex(&t, v)), 1.0 / 12));
        for (std::size_t slot = 0; slot < 4; ++slot) {
            INFO("scale " << scale[0] << " " << scale[1] << " " << scale[2]);
            const CrtTriangle& t = triangles[slot];
            const auto corner = [&](u32 v) { return toDouble(crt_triangle_vertex(&t, v)); };
            const Vec3d n = cross(minus(corner(1), corner(0)), minus(corner(2), corner(0))),
                        ng{faces[slot].normal[0], faces[slot].normal[1], faces[slot].normal[2]};
            CHECK(dot(n, minus(corner(0), middle)) > 0);
            CHECK(length(minus(unit(n), ng)) < 1e-6);
            CHECK(length(ng) == Approx(1).margin(2e-7));
            REQUIRE(primitives[t.id].normals != CRT_NONE);
            for (u32 v = 0; v < 3; ++v) {
                const CrtNormals& shading = normals[primitives[t.id].normals];
                const Vec3d ns{shading.n[v], shading.n[3 + v], shading.n[6 + v]};
                CHECK(length(ns) == Approx(1).margin(2e-7));
                // A normal and a direction transform so that their product keeps its sign.
                CHECK(dot(ns, minus(corner(v), middle)) > 0);
            }
        }
    }
}

TEST_CASE("shading normals stay perpendicular to their surface under any transform", "[compile]") {
    Random random(42);
    for (int i = 0; i < 100; ++i) {
        Scene scene = litFloor();
        const Vec3d n = random.direction();
        crt::Mesh& mesh = scene.meshes[0];
        const Vec3d x = unit(cross(n, random.direction())), y = cross(n, x);
        mesh.positions = {{0, 0, 0}, x, y};
        mesh.triangles = mesh.normal_index = {{0, 1, 2}};
        mesh.normals = {n, times(n, 3), times(n, 1e-3)};  // any length
        scene.objects.resize(1);
        for (double& m : scene.objects[0].transforms[0]) m = random.uniform(-1, 1);
        scene.objects[0].transforms[0][12] = scene.objects[0].transforms[0][13] =
            scene.objects[0].transforms[0][14] = 0;
        scene.objects[0].transforms[0][15] = 1;
        const CompiledScene c = compiled(scene);
        const auto face = listOf<CrtFace>(c, headerOf(c).faces)[0];
        const auto normals = listOf<CrtNormals>(c, headerOf(c).normals)[0];
        for (u32 v = 0; v < 3; ++v)
            for (u32 k = 0; k < 3; ++k) CHECK(normals.n[3 * k + v] == Approx(face.normal[k]).margin(2e-4));
    }
}

TEST_CASE("lengths are moved and scaled exactly", "[compile]") {
    const auto placed = [](double scale, const Vec3d& shift) {
        Scene scene = litFloor();
        for (crt::Mesh& mesh : scene.meshes)
            for (Vec3d& p : mesh.positions) p = plus(times(p, scale), shift);
        scene.camera.position = plus(times(scene.camera.position, scale), shift);
        scene.camera.target = plus(times(scene.camera.target, scale), shift);
        return compiled(scene);
    };
    const CompiledScene here = placed(1, {0, 0, 0});
    CHECK(here.scale_exponent == -3);  // half of 10 is in [2², 2³)
    CHECK(here.centre == Vec3d{0, 1, 0});
    CHECK(headerOf(here).depth_scale == 8);
    // Every coordinate comes back.
    for (const CrtTriangle& t : listOf<CrtTriangle>(here, headerOf(here).triangles))
        for (u32 v = 0; v < 3; ++v) {
            const Vec3d p = plus(times(toDouble(crt_triangle_vertex(&t, v)), 8), here.centre);
            const Vec3d original =
                t.id < 2 ? litFloor().meshes[0].positions[t.id == 0 ? v : (v == 0 ? 0 : v + 1)]
                         : litFloor().meshes[1].positions[t.id == 2 ? v : (v == 0 ? 0 : v + 1)];
            CHECK(p == original);
        }
    // Moved by what doubles represent, nothing in the blob changes; scaled by 2^k, only the way back.
    CHECK(sameBytes(here, placed(1, {1048576, -65536, 3})));
    for (const int k : {-40, -1, 5, 60}) {
        const CompiledScene scaled = placed(std::ldexp(1.0, k), {0, 0, 0});
        CHECK(scaled.scale_exponent == -3 - k);
        CHECK(headerOf(scaled).depth_scale == std::ldexp(8.0f, k));
        const auto a = listOf<CrtTriangle>(here, headerOf(here).triangles),
                   b = listOf<CrtTriangle>(scaled, headerOf(scaled).triangles);
        CHECK(std::memcmp(a.data(), b.data(), a.size() * sizeof(CrtTriangle)) == 0);
        CHECK(std::memcmp(&headerOf(here).camera, &headerOf(scaled).camera, sizeof(CrtCamera)) == 0);
    }
    // For all lengths, coordinates fill [−1, 1] by half at least.
    Random random(43);
    for (int i = 0; i < 50; ++i) {
        const double scale = std::pow(10.0, random.uniform(-30, 30));
        const CompiledScene c =
            placed(scale, times(random.direction(), scale * std::pow(10.0, random.uniform(-3, 6))));
        f32 largest = 0;
        for (const CrtTriangle& t : listOf<CrtTriangle>(c, headerOf(c).triangles))
            for (const f32 x : t.p) largest = std::max(largest, std::abs(x));
        CHECK(largest >= 0.5f);
        CHECK(largest <= 1);
    }
    // Nothing, and a single point.
    CHECK(changed([](Scene& s) { s.objects.clear(); }).scale_exponent == 0);
    const CompiledScene point = changed([](Scene& s) {
        s.objects.resize(1);
        for (Vec3d& p : s.meshes[0].positions) p = {7, 8, 9};
    });
    CHECK(point.scale_exponent == 0);
    CHECK(point.centre == Vec3d{7, 8, 9});
}

TEST_CASE("what cannot be flattened is refused", "[compile]") {
    CHECK_THROWS_AS(changed([](Scene& s) { s.objects[0].transforms[0][0] = 1e308 * 10; }), crt::Error);
    CHECK_THROWS_AS(changed([](Scene& s) { s.camera.position = {1e60, 0, 0}; }), crt::Error);

    // The object's place is named, whichever of its transforms is to blame.
    Scene scene = litFloor();
    scene.objects[1].place = {"scene.yaml", 7};
    scene.objects[1].transforms.resize(5, crt::kIdentity4d);
    scene.objects[1].transforms[4][0] = 1e308 * 10;
    try {
        compiled(scene);
        FAIL("compiled");
    } catch (const crt::Error& error) {
        CHECK(error.place().line == 7);
    }
}

TEST_CASE("materials: the face's own, the object's, or grey, and equal spectra once", "[compile]") {
    Scene scene = litFloor();
    scene.objects[1].emission = -1;
    scene.materials.resize(4);
    for (std::size_t i = 1; i < 4; ++i)
        scene.materials[i].reflectance = crt::constantSpectrum(0.1 * static_cast<double>(i));
    scene.materials[3].reflectance = crt::constantSpectrum(0.5);  // as material 0
    scene.meshes[0].material = {1, -1};
    scene.objects[0].material = 3;
    scene.objects[1].material = -1;
    const CompiledScene c = compiled(scene);
    const CrtContext ctx = contextOf(c);
    const auto primitives = listOf<CrtPrimitive>(c, ctx.scene->primitives);
    const auto materials = listOf<CrtMaterial>(c, ctx.scene->materials);
    REQUIRE(primitives.size() == 4);
    CHECK(primitives[0].material == 1);
    CHECK(primitives[1].material == 3);
    CHECK(primitives[2].material == 4);  // none named: grey .5 behind the author's
    CHECK(primitives[0].object == 0);
    CHECK(primitives[3].object == 1);
    REQUIRE(materials.size() == 5);
    CHECK(materials[4].type == CRT_MATERIAL_DIFFUSE);
    CHECK(V4X(crt_value(&ctx, materials[4].of.diffuse.reflectance, nullptr, splat4(100))) == 0.5f);
    CHECK(V4X(crt_value(&ctx, materials[1].of.diffuse.reflectance, nullptr, splat4(100))) == 0.1f);
    CHECK(ctx.scene->spectra.count == 0);  // constants need no table
    scene.materials[1].reflectance[7] = scene.materials[3].reflectance[7] = 0.25;
    scene.materials[2].reflectance[9] = 0.75;
    scene.materials[0] = scene.materials[1];
    scene.meshes[0].material = {1, 0};
    const CompiledScene tables = compiled(scene);
    const auto of_tables = listOf<CrtMaterial>(tables, headerOf(tables).materials);
    CHECK(of_tables[0].of.diffuse.reflectance == of_tables[1].of.diffuse.reflectance);
    CHECK(of_tables[0].of.diffuse.reflectance != of_tables[4].of.diffuse.reflectance);
    CHECK(headerOf(tables).spectra.count == 1);  // nothing has materials 2 and 3
    const CrtContext tables_ctx = contextOf(tables);
    CHECK(V4X(crt_value(&tables_ctx, of_tables[1].of.diffuse.reflectance, nullptr, splat4(7))) == 0.25f);
    CHECK(V4X(crt_value(&tables_ctx, of_tables[1].of.diffuse.reflectance, nullptr, splat4(8))) == 0.1f);

    const CompiledScene kinds = changed([](Scene& s) {
        s.materials.resize(5);
        s.materials[1] = {"mirror", crt::MaterialType::Mirror, crt::constantSpectrum(0.9), {}, {}, {}};
        s.materials[2] = {
            "metal", crt::MaterialType::Conductor, {}, crt::constantSpectrum(0.2), crt::constantSpectrum(3),
            {}};
        s.materials[3] = {"glass", crt::MaterialType::Dielectric, {}, crt::constantSpectrum(1.5), {}, {}};
        s.materials[4] = {"flint", crt::MaterialType::Dielectric, {}, dispersiveIndex(), {}, {}};
        s.meshes[0].material = {1, 2};
        s.meshes[1].material = {3, 4};
    });
    const auto m = listOf<CrtMaterial>(kinds, headerOf(kinds).materials);
    CHECK(m[1].type == CRT_MATERIAL_MIRROR);
    CHECK(m[2].type == CRT_MATERIAL_CONDUCTOR);
    CHECK(m[3].type == CRT_MATERIAL_DIELECTRIC);
    CHECK(m[2].flags == 0);
    CHECK(m[3].flags == CRT_MATERIAL_TRANSMITS);
    CHECK(m[4].flags == (CRT_MATERIAL_TRANSMITS | CRT_MATERIAL_DISPERSIVE));
    const CrtContext kinds_ctx = contextOf(kinds);
    CHECK(V4X(crt_value(&kinds_ctx, m[2].of.metal.eta, nullptr, splat4(7))) == 0.2f);
    CHECK(V4X(crt_value(&kinds_ctx, m[2].of.metal.k, nullptr, splat4(7))) == 3);
    CHECK(V4X(crt_value(&kinds_ctx, m[4].of.glass.eta, nullptr, splat4(0))) == 1.6f);
}

TEST_CASE("emitters: one a triangle, or one a parallelogram, with its area and side", "[compile]") {
    const CompiledScene c = compiled(litFloor());
    auto emitters = listOf<CrtLight>(c, headerOf(c).lights);
    REQUIRE(emitters.size() == 1);
    CHECK(emitters[0].kind == CRT_LIGHT_PARALLELOGRAM);
    CHECK(emitters[0].flags == 0);
    CHECK(emitters[0].area == 4.0f / 64);
    CHECK(emitters[0].choice_probability == 1);
    const auto primitives = listOf<CrtPrimitive>(c, headerOf(c).primitives);
    CHECK(primitives[0].light == CRT_NONE);
    CHECK(primitives[2].light == 0);
    CHECK(primitives[3].light == 0);
    // A trapezium is two triangles, and so is a quad of which the halves differ.
    const auto of = [](const std::function<void(Scene&)>& change) {
        const CompiledScene changed_scene = changed(change);
        return listOf<CrtLight>(changed_scene, headerOf(changed_scene).lights);
    };
    emitters = of([](Scene& s) { s.meshes[1].positions[2][0] = 1.5; });
    REQUIRE(emitters.size() == 2);
    CHECK(emitters[0].kind == CRT_LIGHT_TRIANGLE);
    CHECK(emitters[0].choice_probability + emitters[1].choice_probability == Approx(1));
    CHECK(emitters[0].choice_probability / emitters[1].choice_probability ==
          Approx(emitters[0].area / emitters[1].area));
    emitters = of([](Scene& s) {
        s.emissions.push_back({crt::constantSpectrum(6), true});
        s.meshes[1].emission = {0, 1};
    });
    REQUIRE(emitters.size() == 2);
    CHECK(emitters[1].flags == CRT_LIGHT_TWO_SIDED);
    CHECK(emitters[1].choice_probability / emitters[0].choice_probability ==
          Approx(6));  // three times as bright, on both sides
    CHECK(of([](Scene& s) { s.meshes[1].positions[3] = s.meshes[1].positions[2]; }).size() ==
          1);  // the half without area gives no light
    CHECK(of([](Scene& s) { s.emissions[0].radiance = crt::constantSpectrum(0); }).empty());
    // A lamp of which the eye sees next to nothing is chosen more often than its luminance says.
    emitters = of([](Scene& s) {
        s.emissions.push_back({crt::constantSpectrum(0), false});
        s.emissions[1].radiance[470] = 1;
        s.meshes[1].emission = {0, 1};
    });
    REQUIRE(emitters.size() == 2);
    CHECK(emitters[1].choice_probability > 1e-7f);
}

TEST_CASE("the blob is aligned, and every array in it lies inside", "[compile]") {
    for (const crt::Accelerator accelerator :
         {crt::Accelerator::None, crt::Accelerator::Bvh, crt::Accelerator::Aabb}) {
        const CompiledScene c = changed([&](Scene& s) {
            s.integrator.accelerator = accelerator;
            s.film.filter = crt::PixelFilter::Gaussian;
            s.film.spectral.bins = {400, 700, 30};
            s.meshes.push_back(smoothTetrahedron());
            s.objects.emplace_back();
            s.objects.back().mesh = 2;
        });
        CHECK(reinterpret_cast<std::uintptr_t>(c.data()) % 64 == 0);
        CHECK(c.size_bytes % 64 == 0);
        const CrtScene& h = headerOf(c);
        CHECK(h.magic == CRT_SCENE_MAGIC);
#define CRT_ARRAY_SIZE(Row, name, IDENTITY) {h.name, sizeof(Row)},
        const std::pair<CrtSpan, std::size_t> arrays[] = {CRT_SCENE_ARRAYS(CRT_ARRAY_SIZE)};
#undef CRT_ARRAY_SIZE
        for (const auto& [span, size] : arrays) {
            if (span.count == 0) continue;
            CHECK(span.offset % 4 == 0);
            CHECK(span.offset * std::size_t{16} >= sizeof(CrtScene));
            CHECK(span.offset * std::size_t{16} + span.count * size <= c.size_bytes);
        }
        // Nothing is there that nothing reads.
        CHECK((h.nodes.count > 0) == (accelerator == crt::Accelerator::Bvh));
        CHECK((h.triangles8.count > 0) == (accelerator == crt::Accelerator::None));
        CHECK((h.patches.count > 0) == (accelerator == crt::Accelerator::None));
        CHECK((h.objects.count > 0) == (accelerator == crt::Accelerator::Aabb));
        CHECK(h.triangles.count == 8);
        CHECK(h.primitives.count == 8);
        CHECK(h.normals.count == 4);
    }
}
