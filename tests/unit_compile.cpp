// Scene → blob: which features a scene asks for, where the author's lengths and sides go, what lights,
// materials and tables come out, and what is said to be left out.
#include "compile/near_scene.h"
#include "compile/near_surfaces.h"
#include "kernel_test.h"

#include "base/error.h"
#include "compile/distributions.h"
#include "compile/light_tree.h"
#include "compile/scene_identity.h"
#include "render/session.h"

#include <algorithm>
#include <bit>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>

using namespace kernel_test;
using crt::CompiledScene;
using crt::Scene;
using crt::Vec3d;

namespace {

/// A floor of one quad, 10 wide, and above it a lamp of one quad.
Scene litFloor() {
    Scene scene;
    scene.camera.position = {0, 1, -5};
    scene.camera.target = {0, 0, 0};
    scene.film.width = 32;
    scene.film.height = 24;
    scene.materials.resize(1);
    scene.materials[0].reflectance = crt::constantSpectrum(0.5);
    scene.emissions.push_back({crt::constantSpectrum(2), false});
    crt::Mesh floor, lamp;
    floor.positions = {{-5, 0, -5}, {-5, 0, 5}, {5, 0, 5}, {5, 0, -5}};
    lamp.positions = {{-1, 2, -1}, {1, 2, -1}, {1, 2, 1}, {-1, 2, 1}};
    floor.triangles = lamp.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.meshes = {floor, lamp};
    scene.objects.resize(2);
    scene.objects[0].material = scene.objects[1].material = 0;
    scene.objects[1].mesh = 1;
    scene.objects[1].emission = 0;
    return scene;
}

CompiledScene compiled(const Scene& scene, std::uint32_t aovs = 0) { return crt::compileScene(scene, aovs); }
CompiledScene changed(const std::function<void(Scene&)>& change) {
    Scene scene = litFloor();
    change(scene);
    return compiled(scene);
}
std::uint64_t featuresOf(const std::function<void(Scene&)>& change) { return changed(change).features; }
const CrtScene& headerOf(const CompiledScene& c) { return *reinterpret_cast<const CrtScene*>(c.data()); }

bool sameBytes(const CompiledScene& a, const CompiledScene& b) {
    return a.size_bytes == b.size_bytes && std::memcmp(a.data(), b.data(), a.size_bytes) == 0;
}

template <class T>
std::vector<T> listOf(const CompiledScene& c, CrtSpan span) {
    const T* first = arrayOf<T>(c, span);
    return std::vector<T>(first, first + span.count);
}

crt::Mesh smoothTetrahedron() {
    crt::Mesh mesh;
    mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    mesh.normals = mesh.positions;
    mesh.normal_index = mesh.triangles;
    return mesh;
}

crt::Spectrum dispersiveIndex() {
    crt::Spectrum s = crt::constantSpectrum(1.5);
    s[0] = 1.6;
    return s;
}

crt::Environment clearSky(bool sampled) {
    crt::Environment sky{crt::illuminantSpectrum("D65").value(), sampled};
    sky.sky = crt::CieSky{.towards_sun = {0.6, 0.8, 0}, .rows = 16};
    return sky;
}

void makeGlass(Scene& s) {
    s.materials[0].type = crt::MaterialType::Dielectric;
    s.materials[0].eta = crt::constantSpectrum(1.5);
}

}  // namespace

TEST_CASE("the mask names kinds, never values", "[compile]") {
    const std::uint64_t base = compiled(litFloor()).features;
    CHECK(base == (CRT_FEATURE_SOBOL | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_DIFFUSE |
                   CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_REPLICATES));
    Random random(41);
    for (int i = 0; i < 50; ++i) {
        CHECK(
            featuresOf([&](Scene& s) {
                s.camera.position = {random.uniform(-9, 9), random.uniform(0.1, 9), random.uniform(-9, -1)};
                s.camera.tan_half_width = random.uniform(0.01, 2);
                s.film.width = 1 + static_cast<int>(random.below(500));
                s.materials[0].reflectance = crt::constantSpectrum(random.uniform());
                s.emissions[0].radiance = crt::constantSpectrum(random.uniform(0.1, 100));
                s.sampler.seed = random.bits();
                s.integrator.max_depth = 1 + static_cast<int>(random.below(100));
                s.integrator.roulette = random.bits() & 1;
                for (crt::Vec3d& p : s.meshes[1].positions) p[0] += random.uniform(-1, 1);
            }) == base);
    }
    // A material that no surface has is no need.
    CHECK(featuresOf([](Scene& s) {
              s.materials.resize(2);
              s.materials[1].type = crt::MaterialType::Dielectric;
              s.materials[1].eta = dispersiveIndex();
          }) == base);
}

TEST_CASE("every feature bit is set by some scene, and by nothing else", "[compile]") {
    const std::uint64_t base = compiled(litFloor()).features;
    const auto differs = [&](std::uint64_t added, std::uint64_t removed,
                             const std::function<void(Scene&)>& change) {
        const std::uint64_t mask = featuresOf(change);
        INFO("expected +" << crt::featureNames(added) << " -" << crt::featureNames(removed) << ", got "
                          << crt::featureNames(mask));
        CHECK(mask == ((base | added) & ~removed));
        return mask;
    };
    std::uint64_t seen = base;
    constexpr std::uint64_t sobol = CRT_FEATURE_SOBOL;
    seen |= differs(CRT_FEATURE_INDEPENDENT, sobol,
                    [](Scene& s) { s.sampler.type = crt::SamplerType::Independent; });
    seen |=
        differs(CRT_FEATURE_XORSHIFT, sobol, [](Scene& s) { s.sampler.type = crt::SamplerType::XorShift; });
    differs(0, CRT_FEATURE_REPLICATES, [](Scene& s) { s.sampler.replicates = 1; });
    differs(CRT_FEATURE_INDEPENDENT, CRT_FEATURE_SOBOL | CRT_FEATURE_REPLICATES, [](Scene& s) {
        s.sampler.type = crt::SamplerType::Independent;
        s.sampler.replicates = 1;
    });
    seen |= differs(CRT_FEATURE_BVH, CRT_FEATURE_BRUTE_FORCE,
                    [](Scene& s) { s.integrator.accelerator = crt::Accelerator::Bvh; });
    seen |= differs(CRT_FEATURE_AABB, CRT_FEATURE_BRUTE_FORCE,
                    [](Scene& s) { s.integrator.accelerator = crt::Accelerator::Aabb; });
    const auto other = [](crt::MaterialType type) {
        return [type](Scene& s) {
            s.materials.resize(2);
            s.materials[1].type = type;
            s.materials[1].eta = s.materials[1].k = s.materials[1].reflectance = crt::constantSpectrum(1.5);
            s.objects[1].material = 1;
        };
    };
    seen |= differs(CRT_FEATURE_MIRROR, 0, other(crt::MaterialType::Mirror));
    seen |= differs(CRT_FEATURE_CONDUCTOR, 0, other(crt::MaterialType::Conductor));
    seen |= differs(CRT_FEATURE_ROUGH_CONDUCTOR, 0, other(crt::MaterialType::RoughConductor));
    seen |= differs(CRT_FEATURE_TEXTURE, 0, [](Scene& s) {
        s.textures.emplace_back().kind = crt::Texture::Kind::Checker;
        s.materials[0].reflectance_texture = 0;
    });
    const auto mixed = [&](crt::MaterialType part) {
        return [&, part](Scene& s) {
            other(part)(s);
            s.materials.emplace_back().type = crt::MaterialType::Mix;
            s.materials[2].parts = {0, 1};
            s.objects[1].material = 2;
        };
    };
    seen |= differs(CRT_FEATURE_MIX, 0, mixed(crt::MaterialType::Diffuse));
    differs(CRT_FEATURE_MIX | CRT_FEATURE_MIRROR, 0, mixed(crt::MaterialType::Mirror));
    seen |= differs(CRT_FEATURE_OPACITY, 0, [](Scene& s) { s.materials[0].opacity = 0.5; });
    differs(CRT_FEATURE_OPACITY | CRT_FEATURE_TEXTURE, 0, [](Scene& s) {
        s.textures.emplace_back().kind = crt::Texture::Kind::Checker;
        s.materials[0].opacity_texture = 0;
    });
    seen |= differs(CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE, 0, [](Scene& s) {
        s.textures.emplace_back().kind = crt::Texture::Kind::Checker;
        s.materials[0].normal_texture = 0;
    });
    seen |= differs(CRT_FEATURE_DIELECTRIC, 0, other(crt::MaterialType::Dielectric));
    seen |= differs(CRT_FEATURE_ROUGH_DIELECTRIC, 0, other(crt::MaterialType::RoughDielectric));
    seen |= differs(CRT_FEATURE_THIN_DIELECTRIC, 0, other(crt::MaterialType::ThinDielectric));
    differs(CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_DISPERSION | CRT_FEATURE_TABLE, 0, [&](Scene& s) {
        other(crt::MaterialType::RoughDielectric)(s);
        s.materials[1].eta = dispersiveIndex();
    });
    seen |= differs(CRT_FEATURE_PLASTIC, 0, other(crt::MaterialType::Plastic));
    differs(CRT_FEATURE_PLASTIC | CRT_FEATURE_TABLE, 0, [&](Scene& s) {
        other(crt::MaterialType::Plastic)(s);
        s.materials[1].roughness = 0.5;  // what its coat reflects is a table
    });
    seen |= differs(CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ABSORPTION, 0, [&](Scene& s) {
        other(crt::MaterialType::Dielectric)(s);
        s.materials[1].absorption = crt::constantSpectrum(2);
    });
    differs(CRT_FEATURE_DIELECTRIC, 0, [&](Scene& s) {
        other(crt::MaterialType::Dielectric)(s);
        s.materials[1].absorption = crt::constantSpectrum(0);
    });
    const auto film = [](Scene& s, double thickness_nm) {
        s.materials[1].film_thickness_nm = thickness_nm;
        s.materials[1].film_index = crt::constantSpectrum(1.3);
    };
    seen |= differs(CRT_FEATURE_CONDUCTOR | CRT_FEATURE_THIN_FILM, 0, [&](Scene& s) {
        other(crt::MaterialType::Conductor)(s);
        film(s, 300);
    });
    differs(CRT_FEATURE_DIELECTRIC, 0, [&](Scene& s) {
        other(crt::MaterialType::Dielectric)(s);
        film(s, 0);
    });
    // A pane bends nothing, whatever its index.
    differs(CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_TABLE, 0, [&](Scene& s) {
        other(crt::MaterialType::ThinDielectric)(s);
        s.materials[1].eta = dispersiveIndex();
    });
    seen |= differs(CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION | CRT_FEATURE_TABLE, 0, [&](Scene& s) {
        other(crt::MaterialType::Dielectric)(s);
        s.materials[1].eta = dispersiveIndex();
    });
    seen |= differs(CRT_FEATURE_SMOOTH_NORMALS, 0, [](Scene& s) {
        s.meshes.push_back(smoothTetrahedron());
        s.objects.emplace_back();
        s.objects.back().mesh = 2;
    });
    seen |= differs(CRT_FEATURE_ENVIRONMENT, 0,
                    [](Scene& s) { s.environment = crt::Environment{crt::constantSpectrum(1)}; });
    seen |= differs(CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT, 0, [](Scene& s) {
        s.environment = crt::Environment{crt::constantSpectrum(1), true};
    });
    const auto lamp = [](crt::PointLightType type) {
        return [type](Scene& s) {
            s.point_lights.resize(1);
            s.point_lights[0].type = type;
            s.point_lights[0].spectrum = crt::constantSpectrum(1);
            s.point_lights[0].ies = std::make_shared<crt::IesProfile>(
                crt::IesProfile{{0, 90}, {0}, {2, 1}});
        };
    };
    seen |= differs(CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_IMAGE | CRT_FEATURE_TABLE, 0,
                    [](Scene& s) { s.environment = clearSky(false); });
    differs(CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_IMAGE | CRT_FEATURE_ENVIRONMENT_LIGHT |
                CRT_FEATURE_TABLE,
            0, [](Scene& s) { s.environment = clearSky(true); });
    for (const auto& [type, word] : crt::kPointLightNames) {
        INFO(word);
        seen |= differs(CRT_FEATURE_POINT_LIGHT, 0, lamp(type));
        differs(CRT_FEATURE_POINT_LIGHT, CRT_FEATURE_AREA_LIGHT, [&, type = type](Scene& s) {
            lamp(type)(s);
            s.objects[1].emission = -1;
        });
        // Glass shows a sun and nothing of the others.
        differs((type == crt::PointLightType::Sun ? std::uint64_t{CRT_FEATURE_POINT_LIGHT} : 0u) |
                    CRT_FEATURE_DIELECTRIC,
                CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, [&, type = type](Scene& s) {
                    lamp(type)(s);
                    makeGlass(s);
                });
        differs(0, 0, [&, type = type](Scene& s) {
            lamp(type)(s);
            s.point_lights[0].strength = 0;
        });
    }
    seen |= differs(CRT_FEATURE_LENS, 0, [](Scene& s) { s.camera.aperture_radius = 0.1; });
    seen |= differs(CRT_FEATURE_FILTER, 0, [](Scene& s) { s.film.filter = crt::PixelFilter::Gaussian; });
    constexpr std::uint64_t light =
        CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_REPLICATES;
    seen |=
        differs(CRT_FEATURE_VIEW, light, [](Scene& s) { s.integrator.type = crt::IntegratorType::Normals; });
    seen |= differs(CRT_FEATURE_VIEW, light | CRT_FEATURE_BRUTE_FORCE,
                    [](Scene& s) { s.integrator.type = crt::IntegratorType::Aabb; });
    const auto many = [](Scene& s) {  // each quad in a place of its own
        s.objects[1].transforms.resize(crt::kLightTreeLights, crt::kIdentity4d);
        for (std::size_t i = 0; i < crt::kLightTreeLights; ++i)
            s.objects[1].transforms[i][3] = 3.0 * static_cast<double>(i);
        s.integrator.accelerator = crt::Accelerator::None;
    };
    seen |= differs(CRT_FEATURE_LIGHT_TREE, 0, many);
    differs(0, CRT_FEATURE_NEE, [&](Scene& s) {
        many(s);
        s.integrator.nee = false;
    });
    seen |= differs(CRT_FEATURE_SPECTRAL_FILM, 0, [](Scene& s) { s.film.spectral.bins = {400, 700, 30}; });
    differs(CRT_FEATURE_SPECTRAL_FILM, 0, [](Scene& s) {
        s.film.spectral.responses = {{"flat", crt::constantSpectrum(1)}};
    });
    differs(CRT_FEATURE_VIEW, light, [](Scene& s) {  // which shows no spectrum
        s.film.spectral.bins = {400, 700, 30};
        s.integrator.type = crt::IntegratorType::Normals;
    });
    seen |= compiled(litFloor(), crt::kAovDepth).features;
    CHECK(compiled(litFloor(), crt::kAovDepth).features == (base | CRT_FEATURE_AOV));
    // The film keeps these itself; the kernel need not know.
    CHECK(compiled(litFloor(), crt::kAovVariance | crt::kAovSamples).features == base);
    seen |= differs(CRT_FEATURE_TABLE, 0, [](Scene& s) { s.emissions[0].radiance[5] *= 2; });
    CHECK(seen == CRT_FEATURES_ALL);

    differs(0, CRT_FEATURE_NEE, [](Scene& s) { s.integrator.nee = false; });
    differs(CRT_FEATURE_DIELECTRIC, CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, makeGlass);
    differs(0, CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE, [](Scene& s) { s.objects[1].emission = -1; });
    differs(0, CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
            [](Scene& s) { s.emissions[0].radiance = crt::constantSpectrum(0); });
    // Nothing is scattered at depth 0.
    differs(0, CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, [](Scene& s) { s.integrator.max_depth = 0; });
    // But the albedo is asked for.
    Scene flat = litFloor();
    flat.integrator.max_depth = 0;
    CHECK(compiled(flat, crt::kAovAlbedo).features == ((base | CRT_FEATURE_AOV) & ~CRT_FEATURE_NEE));
    CHECK(compiled(flat, crt::kAovNormal).features ==
          ((base | CRT_FEATURE_AOV) & ~(CRT_FEATURE_NEE | CRT_FEATURE_DIFFUSE)));
    differs(CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_TABLE, CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE,
            [](Scene& s) {
                s.integrator.max_depth = 0;
                makeGlass(s);
                s.materials[0].eta = dispersiveIndex();
                s.environment = crt::Environment{crt::constantSpectrum(1)};
            });
    // More triangles than brute force is good for.
    differs(CRT_FEATURE_BVH, CRT_FEATURE_BRUTE_FORCE,
            [](Scene& s) { s.objects[0].transforms.resize(40, crt::kIdentity4d); });
}

TEST_CASE("the list of features is the mask, bit by bit", "[compile]") {
    std::uint64_t mask = 0, count = 0;
    std::set<std::string> names;
#define CRT_TEST_FEATURE(bit, name, text) \
    ++count;                              \
    CHECK(CRT_FEATURE_##name == 1ul << bit); \
    CHECK(CRT_BIT_##name == bit);         \
    CHECK(std::strlen(text) > 5);         \
    mask |= 1ul << bit;                   \
    names.insert(crt::featureNames(1ul << bit));
    CRT_FEATURE_LIST(CRT_TEST_FEATURE)
#undef CRT_TEST_FEATURE
    CHECK(mask == CRT_FEATURES_ALL);
    CHECK(mask == (1ul << count) - 1);  // no bit twice, and no hole among them
    CHECK(names.size() == count);
    CHECK(crt::featureNames(CRT_FEATURE_BVH | CRT_FEATURE_AREA_LIGHT) == "bvh, area-light");
    CHECK(crt::featureNames(0).empty());
}

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
    // Whatever the lengths, coordinates fill [−1, 1] by half at least.
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

TEST_CASE("shares of 2^32 are proportional, at least one each, and all of it", "[compile]") {
    const auto check = [](const std::vector<double>& weights) {
        const std::vector<std::uint64_t> first = crt::choiceTable(weights);
        REQUIRE(first.size() == weights.size() + 1);
        CHECK(first.front() == 0);
        CHECK(first.back() == std::uint64_t{1} << 32);
        double total = 0, worst = 0;
        for (const double w : weights) total += w;
        std::uint64_t without = 0;
        const double others = static_cast<double>(weights.size());
        for (std::size_t i = 0; i < weights.size(); ++i) {
            without += first[i + 1] <= first[i];
            // One share is given to each before the rest is dealt out, and rounding takes less than another.
            const double wanted = 1 + (0x1p32 - others) * (weights[i] / total);
            worst = std::max(worst, std::abs(static_cast<double>(first[i + 1] - first[i]) - wanted));
        }
        CHECK(without == 0);
        CHECK(worst < 1.01);
    };
    CHECK(crt::choiceTable({}) == std::vector<std::uint64_t>{0});
    CHECK(crt::choiceTable({3}) == std::vector<std::uint64_t>{0, std::uint64_t{1} << 32});
    // Equal ones of a power of two are exactly equal.
    const std::vector<std::uint64_t> eight = crt::choiceTable(std::vector<double>(8, 0.1));
    for (std::uint64_t i = 0; i <= 8; ++i) CHECK(eight[i] == i << 29);
    check({1e20, 1});
    check({1, 1e20});
    check({1e-20, 1, 1e-20});
    check({0.1, 0.2, 0.3, 0.4});
    Random random(44);
    std::vector<double> many(300000);
    for (double& w : many) w = std::pow(10.0, random.uniform(-12, 3));
    check(many);
    // As many faint as strong ones: each faint one's share must come from somewhere.
    std::vector<double> classes(140000, 1e-20);
    for (std::size_t i = 0; i < 65536; ++i) classes[2 * i] = 1;
    check(classes);
}

TEST_CASE("four wavelengths of one path nearly integrate a smooth spectrum by themselves", "[compile]") {
    const std::vector<float> nodes = crt::wavelengthTable(CRT_WAVELENGTH_TABLE);
    const auto& cie = crt::cieObserver();
    const auto at = [](const crt::Spectrum& s, double nm) {
        const auto i =
            std::min(static_cast<std::size_t>(nm - 360), static_cast<std::size_t>(crt::kSpectrumSize - 2));
        return s[i] + (nm - 360 - static_cast<double>(i)) * (s[i + 1] - s[i]);
    };
    // Relative standard deviation, over the comb's position, of X, Y or Z of light whose spectrum rises in a
    // straight line from `blue` to `red`.
    const auto deviation = [&](const crt::Spectrum& observer, double blue, double red) {
        double sum = 0, squares = 0;
        const std::size_t combs = CRT_WAVELENGTH_TABLE / 4;
        for (std::size_t i = 0; i < combs; ++i) {
            double value = 0;
            for (std::size_t tooth = 0; tooth < 4; ++tooth) {
                const std::size_t cell = tooth * combs + i;
                const double width = nodes[cell + 1] - nodes[cell], nm = nodes[cell] + 0.5 * width;
                value += at(observer, nm) * (blue + (red - blue) * (nm - 360) / 470) * width;
            }
            sum += value;
            squares += value * value;
        }
        const double mean = sum / static_cast<double>(combs);
        return std::sqrt(squares / static_cast<double>(combs) - mean * mean) / mean;
    };
    // A density proportional to x̄ + ȳ + z̄ has .107, .159 and .249 of white.
    for (const double red : {0.2, 1.0, 5.0}) {
        CHECK(deviation(cie[0], 1, red) < 0.06);
        CHECK(deviation(cie[1], 1, red) < 0.06);
        CHECK(deviation(cie[2], 1, red) < 0.10);
    }
}

TEST_CASE("wavelength and filter tables are monotone, complete, and distributed as they say", "[compile]") {
    const std::vector<float> wavelengths = crt::wavelengthTable(CRT_WAVELENGTH_TABLE);
    REQUIRE(wavelengths.size() == CRT_WAVELENGTH_TABLE + 1);
    CHECK(wavelengths.front() == 360);
    CHECK(wavelengths.back() == 830);
    for (std::size_t i = 1; i < wavelengths.size(); ++i)
        if (!(wavelengths[i] > wavelengths[i - 1])) FAIL("wavelengths stand still at " << i);
    // Each cell holds the same part of (x̄ + ȳ + z̄)^0.4.
    const auto& cie = crt::cieObserver();
    const auto density = [&](int nm) {
        const auto k = static_cast<std::size_t>(nm - 360);
        return std::pow(cie[0][k] + cie[1][k] + cie[2][k], 0.4);
    };
    const auto cumulative = [&](double nm) {
        double sum = 0;
        for (int i = 360; i < 830; ++i) {
            const double part = std::clamp(nm - i, 0.0, 1.0);
            sum += part * (density(i) + 0.5 * part * (density(i + 1) - density(i)));
        }
        return sum;
    };
    const double all = cumulative(830);
    for (std::size_t i = 0; i <= CRT_WAVELENGTH_TABLE; i += 16)
        CHECK(cumulative(wavelengths[i]) / all ==
              Approx(static_cast<double>(i) / CRT_WAVELENGTH_TABLE).margin(2e-4));

    // Density is constant in a cell: where x̄ falls to half within 10 nm a wide one would be a spike in the
    // integrand.
    for (std::size_t i = 1; i < wavelengths.size(); ++i)
        if (wavelengths[i] < 780 && wavelengths[i] - wavelengths[i - 1] > 12)
            FAIL("a cell of " << wavelengths[i] - wavelengths[i - 1] << " nm at " << wavelengths[i]);

    crt::FilmSettings film;
    CHECK(crt::filterTable(film, CRT_FILTER_TABLE).empty());  // the pixel itself
    film.filter_radius = 1;
    const std::vector<float> box = crt::filterTable(film, CRT_FILTER_TABLE);
    CHECK(box[CRT_FILTER_TABLE / 4] == Approx(-0.5));
    film.filter_radius = 1.5;
    for (const crt::PixelFilter filter : {crt::PixelFilter::Gaussian, crt::PixelFilter::BlackmanHarris}) {
        film.filter = filter;
        const std::vector<float> table = crt::filterTable(film, CRT_FILTER_TABLE);
        REQUIRE(table.size() == CRT_FILTER_TABLE + 1);
        CHECK(table.front() == -1.5f);
        CHECK(table.back() == 1.5f);
        for (std::size_t i = 1; i < table.size(); ++i) {
            if (!(table[i] > table[i - 1])) FAIL("offsets stand still at " << i);
            CHECK(table[i] == Approx(-table[CRT_FILTER_TABLE - i]).margin(1e-6));
        }
        // Each cell holds the same part of the filter: midpoint sums of its definition up to the nodes.
        const auto value = [&](double x) {
            const double t = 3.14159265358979323846 * (x / 1.5 + 1);
            return filter == crt::PixelFilter::Gaussian
                       ? std::exp(-2 * x * x) - std::exp(-2 * 2.25)
                       : 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) -
                             0.01168 * std::cos(3 * t);
        };
        constexpr int kSteps = 2000;
        const auto mass = [&](double lower, double upper) {
            double sum = 0;
            for (int i = 0; i < kSteps; ++i) sum += value(lower + (upper - lower) * (i + 0.5) / kSteps);
            return sum * (upper - lower) / kSteps;
        };
        const double all_of_it = mass(-1.5, 1.5);
        for (std::size_t i = 16; i < CRT_FILTER_TABLE; i += 16)
            CHECK(mass(-1.5, table[i]) / all_of_it ==
                  Approx(static_cast<double>(i) / CRT_FILTER_TABLE).margin(2e-6));
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
    CHECK(V4X(crt_value(&ctx, materials[4].reflectance, nullptr, splat4(100))) == 0.5f);
    CHECK(V4X(crt_value(&ctx, materials[1].reflectance, nullptr, splat4(100))) == 0.1f);
    CHECK(ctx.scene->spectra.count == 0);  // constants need no table
    scene.materials[1].reflectance[7] = scene.materials[3].reflectance[7] = 0.25;
    scene.materials[2].reflectance[9] = 0.75;
    scene.materials[0] = scene.materials[1];
    scene.meshes[0].material = {1, 0};
    const CompiledScene tables = compiled(scene);
    const auto of_tables = listOf<CrtMaterial>(tables, headerOf(tables).materials);
    CHECK(of_tables[0].reflectance == of_tables[1].reflectance);
    CHECK(of_tables[0].reflectance != of_tables[4].reflectance);
    CHECK(headerOf(tables).spectra.count == 1);  // nothing has materials 2 and 3
    const CrtContext tables_ctx = contextOf(tables);
    CHECK(V4X(crt_value(&tables_ctx, of_tables[1].reflectance, nullptr, splat4(7))) == 0.25f);
    CHECK(V4X(crt_value(&tables_ctx, of_tables[1].reflectance, nullptr, splat4(8))) == 0.1f);

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
    CHECK(V4X(crt_value(&kinds_ctx, m[2].eta, nullptr, splat4(7))) == 0.2f);
    CHECK(V4X(crt_value(&kinds_ctx, m[2].k, nullptr, splat4(7))) == 3);
    CHECK(V4X(crt_value(&kinds_ctx, m[4].eta, nullptr, splat4(0))) == 1.6f);
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

TEST_CASE("walls with the whole scene before them are not asked whether they occlude", "[compile]") {
    const auto room = [](bool with_screen) {
        Scene scene = litFloor();
        crt::Mesh& mesh = scene.meshes[0];
        mesh.positions.clear();
        for (int i = 0; i < 8; ++i)
            mesh.positions.push_back(
                {static_cast<double>(i & 1), static_cast<double>(i >> 1 & 1), static_cast<double>(i >> 2)});
        mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                          {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
        if (with_screen) {
            mesh.positions.insert(mesh.positions.end(), {{0.2, 0.2, 0.5}, {0.8, 0.2, 0.5}, {0.5, 0.8, 0.5}});
            mesh.triangles.push_back({8, 9, 10});
        }
        scene.objects.resize(1);
        return scene;
    };
    CHECK(headerOf(compiled(room(false))).occluders8.count == 0);
    CHECK(headerOf(compiled(room(false))).triangles8.count == 2);
    const CompiledScene screened = compiled(room(true));
    REQUIRE(headerOf(screened).occluders8.count == 1);
    const auto block = listOf<CrtTriangle8>(screened, headerOf(screened).occluders8)[0];
    CHECK(block.slot[0] == 12);
    CHECK(block.slot[1] == CRT_NONE);
    // Not of many triangles, where asking would take longer than rendering.
    Scene many = room(false);
    many.integrator.accelerator = crt::Accelerator::None;
    many.objects[0].transforms.resize(6, crt::kIdentity4d);
    CHECK(headerOf(compiled(many)).occluders8.count == 9);
}

TEST_CASE("what is left out is listed with a reason, and what is needed is not", "[compile]") {
    const auto listed = [](const CompiledScene& c, const std::string& what) {
        return std::any_of(c.left_out.begin(), c.left_out.end(), [&](const auto& entry) {
            return entry.first == what && entry.second.size() > 5;
        });
    };
    const CompiledScene plain = compiled(litFloor());
    for (const char* what :
         {"BVH", "mirror", "smooth conductor", "smooth dielectric, total internal reflection",
          "tables of spectra", "hero wavelength selection", "shading normals",
          "environment", "thin lens", "pixel filter table", "AOV buffers", "normals and bounding-box views",
          "independent sampler", "xorshift sampler"}) {
        INFO(what);
        CHECK(listed(plain, what));
    }
    for (const char* what : {"Sobol sampler", "emission from surfaces", "light sampling and shadow rays"}) {
        INFO(what);
        CHECK_FALSE(listed(plain, what));
    }
    Scene rich = litFloor();
    makeGlass(rich);
    rich.materials[0].eta = dispersiveIndex();
    rich.integrator.accelerator = crt::Accelerator::Bvh;
    rich.camera.aperture_radius = 0.1;
    rich.film.filter = crt::PixelFilter::BlackmanHarris;
    rich.environment = crt::Environment{crt::constantSpectrum(1)};
    const CompiledScene full = compiled(rich, crt::kAovAlbedo);
    for (const char* what : {"BVH", "smooth dielectric, total internal reflection", "tables of spectra",
                             "hero wavelength selection", "environment", "thin lens",
                             "pixel filter table", "AOV buffers"}) {
        INFO(what);
        CHECK_FALSE(listed(full, what));
    }
    CHECK(listed(full, "light sampling and shadow rays"));  // glass alone cannot be lit by it
}

TEST_CASE("replicates are as few as give the error of a film a thousand degrees of freedom", "[compile]") {
    const auto replicatesFor = [](int width, int height) {
        Scene scene = litFloor();
        scene.film.width = width;
        scene.film.height = height;
        return crt::replicatesOf(scene);
    };
    CHECK(replicatesFor(1, 1) == 16);
    CHECK(replicatesFor(8, 8) == 16);
    CHECK(replicatesFor(16, 16) == 8);
    CHECK(replicatesFor(20, 20) == 4);
    CHECK(replicatesFor(50, 20) == 2);
    CHECK(replicatesFor(16384, 16384) == 2);
    // The film's and not the crop window's, whose pixels must have the film's bits.
    Scene cropped = litFloor();
    cropped.film.width = cropped.film.height = 64;
    cropped.film.crop = {0, 0, 1, 1};
    CHECK(crt::replicatesOf(cropped) == 2);
    cropped.integrator.type = crt::IntegratorType::Normals;
    CHECK(crt::replicatesOf(cropped) == 1);
}

TEST_CASE("AOVs take channels in order, and only those that are asked for", "[compile]") {
    const auto single = [](std::uint32_t aovs) {
        Scene scene = litFloor();
        scene.sampler.replicates = 1;
        return compiled(scene, aovs);
    };
    // The variance of a film of one sequence is that of its samples; of one with replicates, theirs.
    CHECK(single(0).channels == CRT_CHANNELS_BASE + 1);
    CHECK(headerOf(single(0)).square_channel == CRT_CHANNELS_BASE);
    Scene sixteen = litFloor();
    sixteen.sampler.replicates = 16;
    const CompiledScene replicates = compiled(sixteen);
    CHECK(headerOf(replicates).replicate_shift == 4);
    CHECK(headerOf(replicates).square_channel == 0);
    CHECK(headerOf(replicates).replicate_channel == CRT_CHANNELS_BASE);
    CHECK(replicates.channels == CRT_CHANNELS_BASE + 15);
    // Each behind the one before it, in the order of the list, which is that of film files.
    const CompiledScene all = compiled(sixteen, ~0u);
    CHECK(headerOf(all).albedo_channel == CRT_CHANNELS_BASE);
    CHECK(headerOf(all).normal_channel == CRT_CHANNELS_BASE + 3);
    CHECK(headerOf(all).depth_channel == CRT_CHANNELS_BASE + 6);
    CHECK(headerOf(all).replicate_channel == CRT_CHANNELS_BASE + 7);
    CHECK(all.channels == CRT_CHANNELS_MAX - 1);
    const CompiledScene depth = single(crt::kAovDepth);
    CHECK(headerOf(depth).albedo_channel == 0);
    CHECK(headerOf(depth).depth_channel == CRT_CHANNELS_BASE + 1);
    CHECK(headerOf(depth).replicate_channel == 0);
    CHECK(depth.channels == CRT_CHANNELS_BASE + 2);
}

TEST_CASE("bins and responses are the last channels of a film, and leave the others where they were",
          "[compile]") {
    Scene scene = litFloor();
    scene.sampler.replicates = 8;
    const CompiledScene plain = compiled(scene, crt::kAovDepth);
    scene.film.spectral = {{400, 700, 30}, {{"flat", crt::constantSpectrum(2)}}, true};
    const CompiledScene spectral = compiled(scene, crt::kAovDepth);
    CHECK(plain.spectral_channels == 0);
    CHECK(spectral.spectral_channels == 31);
    CHECK(spectral.channels == plain.channels + 31);
    CHECK(headerOf(spectral).depth_channel == headerOf(plain).depth_channel);
    CHECK(headerOf(spectral).replicate_channel == headerOf(plain).replicate_channel);
    const CrtSpectralFilm film = listOf<CrtSpectralFilm>(spectral, headerOf(spectral).spectral_film).at(0);
    CHECK(film.channel == plain.channels);
    CHECK(film.bins == 30);
    CHECK(film.first == 40);
    CHECK(film.per_nm == 0.1f);
    REQUIRE(film.responses.count == 1);
    CHECK(arrayOf<f32>(spectral, film.responses)[100] == static_cast<float>(1.0 / 470));
    const crt::FilmShape shape = crt::filmShapeOf(spectral);
    CHECK(shape.replicates() == 8);
    CHECK(shape.firstSpectral() == film.channel);
    CHECK_NOTHROW(crt::Film(shape));
    crt::FilmShape wrong = shape;
    wrong.spectral = 30;
    CHECK_THROWS_AS(crt::Film(wrong), crt::Error);
}

TEST_CASE("half of the wavelengths of a spectral film are uniform over what it measures", "[compile]") {
    constexpr std::size_t kCells = 1024;
    const std::vector<float> plain = crt::wavelengthTable(kCells);
    CHECK(crt::wavelengthTable(kCells, {}) == plain);
    const crt::SpectralFilm narrow{{600, 610, 10}, {}, true};
    const std::vector<float> table = crt::wavelengthTable(kCells, narrow);
    CHECK(std::is_sorted(table.begin(), table.end()));
    CHECK(table.front() == 360);
    CHECK(table.back() == 830);
    const auto share = [kCells](const std::vector<float>& nodes, float from_nm, float to_nm) {
        const auto at = [&](float nm) { return std::lower_bound(nodes.begin(), nodes.end(), nm); };
        return static_cast<double>(at(to_nm) - at(from_nm)) / kCells;
    };
    // The ends are known to a quarter of a nanometre: a step of the quadrature.
    constexpr double kEnds = 0.5 * 0.25 / 10;
    CHECK(share(table, 600, 610) == Approx(0.5 + 0.5 * share(plain, 600, 610)).margin(kEnds));
    CHECK(share(table, 400, 600) == Approx(0.5 * share(plain, 400, 600)).margin(kEnds));
    // From where a response begins to where it ends.
    crt::Spectrum red;
    for (std::size_t i = 240; i <= 250; ++i) red[i] = 1;
    const std::vector<float> sensor = crt::wavelengthTable(kCells, {{}, {{"red", red}}, true});
    CHECK(share(sensor, 599, 611) == Approx(0.5 + 0.5 * share(plain, 599, 611)).margin(kEnds));
}

TEST_CASE("the bits of AOVs never change: film files hold them", "[compile]") {
    CHECK(crt::kAovAlbedo == 1);
    CHECK(crt::kAovNormal == 2);
    CHECK(crt::kAovDepth == 4);
    CHECK(crt::kAovPrimitive == 8);
    CHECK(crt::kAovVariance == 16);
    CHECK(crt::kAovSamples == 32);
    CHECK(crt::kAovReplicates == 64);
    CHECK(crt::kAovError == 128);
    std::uint32_t seen = 0;
    for (const crt::AovRow& row : crt::kAovRows) {
        CHECK((seen & row.aov) == 0);  // no bit twice
        seen |= row.aov;
    }
    CHECK(crt::kAovSquares == 256);
    CHECK(seen == 511);
    CHECK(crt::kAovsOfFirstHits == 15);
}

TEST_CASE("the hash is the scene's: the same for the same, another for another", "[compile]") {
    const CompiledScene a = compiled(litFloor()), b = compiled(litFloor());
    CHECK(a.hash == b.hash);
    CHECK(sameBytes(a, b));
    CHECK(a.hash.size() == 32);
    CHECK(a.hash.find_first_not_of("0123456789abcdef") == std::string::npos);
    std::map<std::string, std::string> named{{a.hash, "the scene itself"}};
    const auto differs = [&](const std::string& what, const std::function<void(Scene&)>& change) {
        const auto [place, is_new] = named.emplace(changed(change).hash, what);
        INFO(what << " has the hash of " << place->second);
        CHECK(is_new);
    };
    differs("seed", [](Scene& s) { s.sampler.seed = 1; });
    differs("high word of the seed", [](Scene& s) { s.sampler.seed = std::uint64_t{1} << 32; });
    differs("sampler", [](Scene& s) { s.sampler.type = crt::SamplerType::Independent; });
    differs("other sampler", [](Scene& s) { s.sampler.type = crt::SamplerType::XorShift; });
    differs("replicates", [](Scene& s) { s.sampler.replicates = 1; });
    differs("max_depth", [](Scene& s) { s.integrator.max_depth = 3; });
    differs("roulette", [](Scene& s) { s.integrator.roulette = false; });
    differs("roulette_depth", [](Scene& s) { s.integrator.roulette_depth += 1; });
    differs("nee", [](Scene& s) { s.integrator.nee = false; });
    differs("view of normals", [](Scene& s) { s.integrator.type = crt::IntegratorType::Normals; });
    differs("view of boxes", [](Scene& s) { s.integrator.type = crt::IntegratorType::Aabb; });
    differs("camera position", [](Scene& s) { s.camera.position[0] = 0.5; });
    differs("camera target", [](Scene& s) { s.camera.target[1] = 0.5; });
    differs("field of view", [](Scene& s) { s.camera.tan_half_width = 0.25; });
    differs("lens", [](Scene& s) { s.camera.aperture_radius = 0.1; });
    differs("focus", [](Scene& s) {
        s.camera.aperture_radius = 0.1;
        s.camera.focus_distance = 3;
    });
    differs("crop", [](Scene& s) { s.film.crop = {1, 2, 3, 4}; });
    differs("another crop of that size", [](Scene& s) { s.film.crop = {2, 2, 4, 4}; });
    differs("film height", [](Scene& s) { s.film.height = 25; });
    differs("film width", [](Scene& s) { s.film.width = 33; });
    differs("filter", [](Scene& s) {
        s.film.filter = crt::PixelFilter::Gaussian;
        s.film.filter_radius = 1.5;
    });
    differs("filter radius", [](Scene& s) {
        s.film.filter = crt::PixelFilter::Gaussian;
        s.film.filter_radius = 2;
    });
    differs("reflectance", [](Scene& s) { s.materials[0].reflectance[200] = 0.25; });
    differs("material", [](Scene& s) { s.materials[0].type = crt::MaterialType::Mirror; });
    differs("glass", makeGlass);
    differs("index of the glass", [](Scene& s) {
        makeGlass(s);
        s.materials[0].eta = crt::constantSpectrum(1.25);
    });
    const auto glassware = [&](const char* what, crt::MaterialType type, double roughness,
                               double absorption) {
        differs(what, [=](Scene& s) {
            makeGlass(s);
            s.materials[0].type = type;
            s.materials[0].roughness = roughness;
            if (absorption > 0) s.materials[0].absorption = crt::constantSpectrum(absorption);
        });
    };
    const auto mix = [&](const char* what, crt::MaterialType type, double amount) {
        differs(what, [=](Scene& s) {
            s.materials.push_back(s.materials[0]);
            s.materials[1].reflectance = crt::constantSpectrum(0.25);
            s.materials.emplace_back().type = type;
            s.materials[2].parts = {0, 1};
            s.materials[2].amount = amount;
            s.objects[0].material = 2;
        });
    };
    mix("mix", crt::MaterialType::Mix, 0.5);
    mix("its amount", crt::MaterialType::Mix, 0.25);
    mix("sides", crt::MaterialType::TwoSided, 0.25);
    differs("opacity", [](Scene& s) { s.materials[0].opacity = 0.5; });
    differs("another opacity", [](Scene& s) { s.materials[0].opacity = 0.25; });
    for (const double strength : {1.0, 0.5})
        differs("normal map", [=](Scene& s) {
            s.textures.emplace_back().kind = crt::Texture::Kind::Checker;
            s.materials[0].normal_texture = 0;
            s.materials[0].normal_strength = strength;
        });
    glassware("rough glass", crt::MaterialType::RoughDielectric, 0.5, 0);
    glassware("its roughness", crt::MaterialType::RoughDielectric, 0.25, 0);
    glassware("its absorption", crt::MaterialType::RoughDielectric, 0.25, 1);
    glassware("glass that absorbs", crt::MaterialType::Dielectric, 0, 1);
    glassware("glass that absorbs more", crt::MaterialType::Dielectric, 0, 2);
    glassware("a pane", crt::MaterialType::ThinDielectric, 0, 0);
    const auto filmed = [&](const char* what, double thickness_nm, double index) {
        differs(what, [=](Scene& s) {
            makeGlass(s);
            s.materials[0].film_thickness_nm = thickness_nm;
            s.materials[0].film_index = crt::constantSpectrum(index);
        });
    };
    filmed("a film on glass", 300, 1.4);
    filmed("its thickness", 301, 1.4);
    filmed("its index", 300, 1.5);
    glassware("plastic", crt::MaterialType::Plastic, 0, 0);
    glassware("rough plastic", crt::MaterialType::Plastic, 0.5, 0);
    differs("radiance", [](Scene& s) { s.emissions[0].radiance[100] = 3; });
    differs("two-sided", [](Scene& s) { s.emissions[0].two_sided = true; });
    differs("what emits", [](Scene& s) { s.objects[0].emission = 0; });
    differs("environment", [](Scene& s) { s.environment = crt::Environment{crt::constantSpectrum(1)}; });
    differs("its radiance", [](Scene& s) { s.environment = crt::Environment{crt::constantSpectrum(2)}; });
    const auto lamp = [](const std::function<void(crt::PointLight&)>& change) {
        return [change](Scene& s) {
            s.point_lights.resize(1);
            s.point_lights[0].type = crt::PointLightType::Spot;
            s.point_lights[0].spectrum = crt::constantSpectrum(1);
            change(s.point_lights[0]);
        };
    };
    const auto sky = [](const std::function<void(crt::CieSky&)>& change) {
        return [change](Scene& s) {
            s.environment = clearSky(true);
            change(*s.environment->sky);
        };
    };
    differs("a sky", sky([](crt::CieSky&) {}));
    differs("its type", sky([](crt::CieSky& k) { k.type = 11; }));
    differs("its sun", sky([](crt::CieSky& k) { k.towards_sun = {0, 0.8, 0.6}; }));
    differs("its amount", sky([](crt::CieSky& k) { k.amount = 2; }));
    differs("its rows", sky([](crt::CieSky& k) { k.rows = 18; }));
    differs("its zenith", sky([](crt::CieSky& k) { k.axes = {{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}}; }));
    differs("a lamp without a surface", lamp([](crt::PointLight&) {}));
    differs("its kind", lamp([](crt::PointLight& l) { l.type = crt::PointLightType::Point; }));
    differs("a sun", lamp([](crt::PointLight& l) { l.type = crt::PointLightType::Sun; }));
    differs("a sun's size", lamp([](crt::PointLight& l) {
                l.type = crt::PointLightType::Sun;
                l.angular_diameter_deg = 1;
            }));
    differs("its place", lamp([](crt::PointLight& l) { l.position[2] = 1e-6; }));
    differs("its direction", lamp([](crt::PointLight& l) { l.direction = {0, 0, 1}; }));
    differs("its strength", lamp([](crt::PointLight& l) { l.strength = 2; }));
    differs("its colour", lamp([](crt::PointLight& l) { l.spectrum[3] = 2; }));
    differs("its cone", lamp([](crt::PointLight& l) { l.cone_angle_deg = 31; }));
    const auto ies = [&](const crt::IesProfile& profile, double across = 0) {
        return lamp([=](crt::PointLight& l) {
            l.type = crt::PointLightType::Ies;
            l.ies = std::make_shared<crt::IesProfile>(profile);
            l.across = {std::cos(across), 0, std::sin(across)};
        });
    };
    differs("an IES lamp", ies({{0, 90}, {0}, {2, 1}}));
    differs("its candelas", ies({{0, 90}, {0}, {2, 1.5}}));
    differs("its angles", ies({{0, 180}, {0}, {2, 1}}));
    differs("its sides", ies({{0, 90}, {0, 360}, {2, 1, 2, 1}}));
    differs("how it is turned", ies({{0, 90}, {0}, {2, 1}}, 1));
    const auto beam = [&](double radius, double width, double height) {
        return lamp([=](crt::PointLight& l) {
            l.type = crt::PointLightType::Beam;
            l.radius = radius;
            l.width = width;
            l.height = height;
        });
    };
    differs("a beam", beam(1, 0, 0));
    differs("its radius", beam(2, 0, 0));
    differs("a slit", beam(0, 2, 2));
    differs("its width", beam(0, 3, 2));
    differs("its height", beam(0, 2, 3));
    differs("its penumbra", lamp([](crt::PointLight& l) { l.penumbra_deg = 4; }));
    const auto instrument = [](const std::function<void(crt::SpectralFilm&)>& change) {
        return [change](Scene& s) {
            s.film.spectral = {{400, 700, 30}, {{"flat", crt::constantSpectrum(1)}}, true};
            change(s.film.spectral);
        };
    };
    differs("a spectral film", instrument([](crt::SpectralFilm&) {}));
    differs("where its bins begin", instrument([](crt::SpectralFilm& f) { f.bins.from_nm = 410; }));
    differs("where its bins end", instrument([](crt::SpectralFilm& f) { f.bins.to_nm = 710; }));
    differs("the number of its bins", instrument([](crt::SpectralFilm& f) { f.bins.count = 31; }));
    differs("its bins alone", instrument([](crt::SpectralFilm& f) { f.responses.clear(); }));
    differs("its response", instrument([](crt::SpectralFilm& f) { f.responses[0].spectrum[7] = 2; }));
    differs("its response as it is", instrument([](crt::SpectralFilm& f) { f.normalise = false; }));
    differs("a bin for a response", instrument([](crt::SpectralFilm& f) {
                f.bins.count = 31;
                f.responses.clear();
            }));
    differs("a vertex", [](Scene& s) { s.meshes[0].positions[2][1] = 1e-6; });
    differs("the order of triangles",
            [](Scene& s) { std::swap(s.meshes[0].triangles[0], s.meshes[0].triangles[1]); });
    differs("the first vertex of a triangle", [](Scene& s) { s.meshes[1].triangles[0] = {1, 2, 0}; });
    differs("a triangle less", [](Scene& s) { s.meshes[0].triangles.pop_back(); });
    differs("smooth normals", [](Scene& s) {
        s.meshes[0].normals = {{0, 1, 0}};
        s.meshes[0].normal_index = {{0, 0, 0}, {0, 0, 0}};
    });
    differs("another normal", [](Scene& s) {
        s.meshes[0].normals = {{0.6, 0.8, 0}};
        s.meshes[0].normal_index = {{0, 0, 0}, {0, 0, 0}};
    });
    CHECK(compiled(litFloor(), crt::kAovDepth).hash != a.hash);
    // What the film does with the samples afterwards is not the scene's.
    CHECK(changed([](Scene& s) {
              s.film.exposure_ev = 2;
              s.title = "another";
              s.sampler.samples = 1000;
          }).hash == a.hash);
}

TEST_CASE("the hash is not that of what only finds hits sooner", "[compile]") {
    // Enough triangles for a tree that puts them into another order, among them an emitter and smooth
    // normals.
    const auto withTree = [](crt::Accelerator accelerator) {
        return changed([&](Scene& s) {
            s.integrator.accelerator = accelerator;
            s.objects[0].transforms.resize(20, crt::kIdentity4d);
            for (std::size_t i = 0; i < 20; ++i) s.objects[0].transforms[i][3] = (i * 7) % 20 * 11.0;
            s.meshes.push_back(smoothTetrahedron());
            s.objects.emplace_back();
            s.objects.back().mesh = 2;
            s.objects.back().emission = 0;
        });
    };
    const CompiledScene tree = withTree(crt::Accelerator::Bvh);
    std::vector<std::uint32_t> order;
    for (const CrtTriangle& t : listOf<CrtTriangle>(tree, headerOf(tree).triangles)) order.push_back(t.id);
    REQUIRE_FALSE(std::is_sorted(order.begin(), order.end()));
    REQUIRE(headerOf(tree).lights.count > 2);
    for (const crt::Accelerator accelerator :
         {crt::Accelerator::None, crt::Accelerator::Aabb, crt::Accelerator::Auto}) {
        const CompiledScene other = withTree(accelerator);
        CHECK(other.hash == tree.hash);
        if (accelerator == crt::Accelerator::None) CHECK(other.features != tree.features);
    }
}

TEST_CASE("a better tree and a smaller kernel leave the hash alone", "[compile]") {
    const Scene scene = [] {
        Scene s = litFloor();
        s.integrator.accelerator = crt::Accelerator::Bvh;
        return s;
    }();
    CompiledScene c = compiled(scene);
    auto& header = *reinterpret_cast<CrtScene*>(c.blob.data());
    REQUIRE(header.nodes.count > 0);
    std::vector<std::array<float, 9>> positions(header.triangle_count);
    auto* triangles = const_cast<CrtTriangle*>(arrayOf<CrtTriangle>(c, header.triangles));
    for (std::uint32_t slot = 0; slot < header.triangle_count; ++slot)
        std::copy(std::begin(triangles[slot].p), std::end(triangles[slot].p),
                  positions[triangles[slot].id].begin());
    REQUIRE(crt::sceneIdentity(c.data(), positions) == c.hash);

    // Two leaves change places, as another builder might put them; emitters follow their triangles.
    std::swap(triangles[0], triangles[header.triangle_count - 1]);
    auto* emitters = const_cast<CrtLight*>(arrayOf<CrtLight>(c, header.lights));
    for (std::uint32_t i = 0; i < header.lights.count; ++i) {
        if (emitters[i].slot == 0)
            emitters[i].slot = header.triangle_count - 1;
        else if (emitters[i].slot == header.triangle_count - 1)
            emitters[i].slot = 0;
    }
    header.nodes.count -= 1;
    header.features |= CRT_FEATURE_DIELECTRIC;
    CHECK(crt::sceneIdentity(c.data(), positions) == c.hash);
    // An emitter that does not follow shines elsewhere.
    emitters[0].slot = emitters[0].slot == 0 ? 1 : 0;
    CHECK(crt::sceneIdentity(c.data(), positions) != c.hash);
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
        CHECK(h.features == c.features);
        const std::pair<CrtSpan, std::size_t> arrays[] = {{h.triangles, sizeof(CrtTriangle)},
                                                          {h.faces, sizeof(CrtFace)},
                                                          {h.triangles8, sizeof(CrtTriangle8)},
                                                          {h.occluders8, sizeof(CrtTriangle8)},
                                                          {h.primitives, sizeof(CrtPrimitive)},
                                                          {h.normals, sizeof(CrtNormals)},
                                                          {h.nodes, sizeof(CrtNode4)},
                                                          {h.objects, sizeof(CrtObject)},
                                                          {h.materials, sizeof(CrtMaterial)},
                                                          {h.lights, sizeof(CrtLight)},
                                                          {h.spectra, CRT_SPECTRUM_STRIDE * sizeof(f32)},
                                                          {h.observer, sizeof(f32)},
                                                          {h.wavelengths, sizeof(f32)},
                                                          {h.filter, sizeof(f32)},
                                                          {h.point_lights, sizeof(CrtPointLight)},
                                                          {h.spectral_film, sizeof(CrtSpectralFilm)}};
        for (const auto& [span, size] : arrays) {
            if (span.count == 0) continue;
            CHECK(span.offset % 4 == 0);
            CHECK(span.offset * std::size_t{16} >= sizeof(CrtScene));
            CHECK(span.offset * std::size_t{16} + span.count * size <= c.size_bytes);
        }
        // Nothing is there that nothing reads.
        CHECK((h.nodes.count > 0) == (accelerator == crt::Accelerator::Bvh));
        CHECK((h.triangles8.count > 0) == (accelerator == crt::Accelerator::None));
        CHECK((h.objects.count > 0) == (accelerator == crt::Accelerator::Aabb));
        CHECK(h.triangles.count == 8);
        CHECK(h.primitives.count == 8);
        CHECK(h.normals.count == 4);
    }
}

TEST_CASE("a lamp in the plane of another surface that it overlaps is found, and nothing else",
          "[compile]") {
    const auto quad = [](double x0, double x1, double y, double z0, double z1) {
        crt::Mesh mesh;
        mesh.positions = {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        return mesh;
    };
    const auto found = [&](const crt::Mesh& lamp, bool many) {
        Scene scene;
        scene.camera.position = {0, 1, 0};
        scene.emissions = {{crt::constantSpectrum(1), false}};
        scene.materials.resize(1);
        scene.meshes = {quad(-2, 2, 2, -2, 2), lamp, quad(-2, 2, 0, -2, 2)};
        for (std::uint32_t i = 0; i < 3; ++i) {
            crt::Object object;
            object.mesh = i;
            object.material = 0;
            object.emission = i == 1 ? 0 : -1;
            scene.objects.push_back(object);
        }
        scene.integrator.accelerator = many ? crt::Accelerator::Bvh : crt::Accelerator::None;
        return crt::findCoplanarLight(crt::compileScene(scene, 0));
    };
    for (const bool tree : {false, true}) {
        CAPTURE(tree);
        // In the ceiling; partly; larger than the ceiling; turned over.
        const std::optional<crt::CoplanarLight> inside = found(quad(-0.5, 0.5, 2, -0.5, 0.5), tree);
        REQUIRE(inside);
        CHECK((inside->light == 2 || inside->light == 3));
        CHECK((inside->surface == 0 || inside->surface == 1));
        CHECK(found(quad(1.5, 2.5, 2, -0.5, 0.5), tree));
        CHECK(found(quad(-9, 9, 2, -9, 9), tree));
        CHECK(found(quad(0.5, -0.5, 2, -0.5, 0.5), tree));
        CHECK(found(quad(-0.5, 0.5, 2 - 1e-6, -0.5, 0.5), tree));  // below what rays can tell
        // What is as far off as is advised, beside the ceiling, at its edge, or stands on the floor is
        // right.
        CHECK_FALSE(found(quad(-0.5, 0.5, 2 - 2 * inside->least_gap, -0.5, 0.5), tree));
        CHECK_FALSE(found(quad(3, 4, 2, -0.5, 0.5), tree));
        CHECK_FALSE(found(quad(2, 3, 2, -0.5, 0.5), tree));
        crt::Mesh standing;
        standing.positions = {{-0.5, 0, 0}, {0.5, 0, 0}, {0.5, 1, 0}, {-0.5, 1, 0}};
        standing.triangles = {{0, 1, 2}, {0, 2, 3}};
        CHECK_FALSE(found(standing, tree));
    }
}

namespace {

/// Two wavy sheets of 2 · side² triangles each, the upper one `gap` above the lower, and a lamp.
Scene twoSheets(std::size_t side, double gap) {
    Scene scene = litFloor();
    crt::Mesh& sheet = scene.meshes[0];
    sheet = {};
    const auto add = [&](double height) {
        const auto first = static_cast<std::uint32_t>(sheet.positions.size()),
                   row = static_cast<std::uint32_t>(side + 1);
        for (std::size_t y = 0; y <= side; ++y)
            for (std::size_t x = 0; x <= side; ++x) {
                const double u = static_cast<double>(x) / static_cast<double>(side),
                             v = static_cast<double>(y) / static_cast<double>(side);
                sheet.positions.push_back(
                    {10 * u - 5, height + 0.3 * std::sin(9 * u) * std::cos(7 * v), 10 * v - 5});
            }
        for (std::uint32_t y = 0; y < side; ++y)
            for (std::uint32_t x = 0; x < side; ++x) {
                const std::uint32_t a = first + y * row + x;
                sheet.triangles.push_back({a, a + row, a + 1});
                sheet.triangles.push_back({a + 1, a + row, a + row + 1});
            }
    };
    add(0);
    add(gap);
    return scene;
}

/// 40,000 small triangles: those that are asked about just below the plane y = 0, above each one that is not
/// asked about, and the others far off, so that the plane goes through the scene's middle.
Scene pairsAboutThePlane(double gap) {
    constexpr std::size_t kCount = 40000, kSide = 100;
    Scene scene = litFloor();
    crt::Mesh& mesh = scene.meshes[0];
    mesh = {};
    const std::vector<std::uint32_t> ids = crt::askedTriangles(kCount + 2);  // with the lamp
    const std::set<std::uint32_t> asked(ids.begin(), ids.end());
    std::array<std::size_t, 3> next{};  // Of those that are asked, their neighbours, and the others.
    for (std::uint32_t id = 0; id < kCount; ++id) {
        const std::size_t kind = asked.count(id) != 0 ? 0 : next[1] < kSide * kSide ? 1 : 2;
        const std::size_t place = next[kind]++;
        const double x = (static_cast<double>(place % kSide) - 49.5) * 0.1,
                     z = (static_cast<double>(place / kSide % kSide) - 49.5) * 0.1;
        const double y = kind == 0                                     ? -0.5 * gap
                         : kind == 1                                   ? 0.5 * gap
                         : place % (2 * kSide * kSide) < kSide * kSide ? -6
                                                                       : 6;
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const auto& [dx, dz] : {std::pair{-0.02, -0.02}, {0.02, -0.02}, {0.0, 0.02}})
            mesh.positions.push_back({x + dx, y, z + dz});
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return scene;
}

constexpr double kEverywhere = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("a backend that brings its own acceleration structure gets no BVH, and the same scene otherwise",
          "[compile]") {
    const Scene scene = twoSheets(20, 1);
    const CompiledScene with = compiled(scene),
                        without = crt::compileScene(scene, 0, {.accelerator_reach = 4});
    CHECK_FALSE(with.without_nodes);
    CHECK(with.nodes > 0);
    CHECK(without.without_nodes);
    CHECK(without.nodes == 0);
    CHECK(without.build_seconds == 0);
    CHECK(headerOf(without).nodes.count == 0);
    CHECK(headerOf(without).accelerator == CRT_ACCELERATOR_BVH);
    CHECK(without.features == with.features);
    CHECK(without.hash == with.hash);
    CHECK(without.size_bytes < with.size_bytes);
    const auto left_out = [](const CompiledScene& c) {
        return std::any_of(c.left_out.begin(), c.left_out.end(),
                           [](const auto& what) { return what.first == "BVH"; });
    };
    CHECK(left_out(without));
    CHECK_FALSE(left_out(with));
    // Every slot is its triangle's id.
    const std::vector<CrtTriangle> triangles = listOf<CrtTriangle>(without, headerOf(without).triangles);
    REQUIRE(triangles.size() == 1602);
    for (std::uint32_t slot = 0; slot < triangles.size(); ++slot) REQUIRE(triangles[slot].id == slot);

    // The camera stands at z = -5 in a scene that is 10 wide: 0.625 of the compiled scene. From beyond the
    // reach, and with a lens that goes there, rays need the nodes.
    const auto nodesAt = [&](double z, double aperture) {
        Scene moved = scene;
        moved.camera.position[2] = z;
        moved.camera.aperture_radius = aperture;
        return crt::compileScene(moved, 0, {.accelerator_reach = 4}).nodes;
    };
    CHECK(nodesAt(-31, 0) == 0);
    CHECK(nodesAt(-33, 0) > 0);
    CHECK(nodesAt(-31, 2) > 0);
    // Where no BVH is needed, none is left out.
    CHECK_FALSE(crt::compileScene(litFloor(), 0, {.accelerator_reach = 4}).without_nodes);
}

TEST_CASE("surfaces too near and lamps in a plane are found without a BVH as with one", "[compile]") {
    // Of 40,000 triangles an even choice is looked at.
    for (const double gap : {3e-7, 1e-6, 1.1e-6, 1.0}) {
        const Scene scene = twoSheets(100, gap);
        const CompiledScene with = compiled(scene),
                            without = crt::compileScene(scene, 0, {.accelerator_reach = kEverywhere});
        REQUIRE(without.without_nodes);
        const CompiledScene reduced = crt::nearScene(without);
        const crt::NearSurfaces expected = crt::findNearSurfaces(with),
                                found = crt::findNearSurfaces(reduced);
        INFO("gap " << gap << ", near " << expected.near << " of " << expected.asked);
        CHECK(expected.asked == 10000);
        CHECK(found.asked == expected.asked);
        CHECK(found.near == expected.near);
        CHECK(found.nearest_clearance == expected.nearest_clearance);
        if (gap == 1.0) CHECK(expected.near == 0);
        // So near that some are found, or the comparison was of nothing.
        if (gap == 1e-6) CHECK(expected.near > 0);
    }

    // Neighbours that nobody asks about, beyond the plane through the middle where cells end.
    for (const double gap : {3e-7, 1e-6, 3e-6, 1e-5}) {
        const Scene scene = pairsAboutThePlane(gap);
        const CompiledScene with = compiled(scene),
                            without = crt::compileScene(scene, 0, {.accelerator_reach = kEverywhere});
        REQUIRE(without.without_nodes);
        const crt::NearSurfaces expected = crt::findNearSurfaces(with),
                                found = crt::findNearSurfaces(crt::nearScene(without));
        INFO("gap " << gap << ", near " << expected.near << " of " << expected.asked);
        CHECK(found.near == expected.near);
        if (gap == 1e-6) CHECK(expected.near > 0);
    }

    // Of a large scene only what lies near is kept.
    const CompiledScene large = crt::compileScene(twoSheets(300, 1), 0, {.accelerator_reach = kEverywhere});
    CHECK(headerOf(crt::nearScene(large)).triangle_count < large.triangles / 2);

    Scene lamp = twoSheets(100, 1);
    lamp.meshes[1].positions = {{-1, 3, -1}, {1, 3, -1}, {1, 3, 1}, {-1, 3, 1},
                                {-2, 3, -2}, {2, 3, -2}, {2, 3, 2}};
    lamp.meshes.push_back(lamp.meshes[1]);
    lamp.meshes.back().triangles = {{4, 5, 6}};
    lamp.objects.push_back(lamp.objects[0]);
    lamp.objects.back().mesh = 2;
    const auto with = crt::findCoplanarLight(compiled(lamp));
    const auto without = crt::findCoplanarLight(
        crt::nearScene(crt::compileScene(lamp, 0, {.accelerator_reach = kEverywhere})));
    REQUIRE(with);
    REQUIRE(without);
    CHECK(without->surface == with->surface);
    CHECK(without->least_gap == with->least_gap);
}
