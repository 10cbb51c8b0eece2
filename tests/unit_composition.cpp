// Materials made of others, and surfaces that are there in part: what the kernel chooses and passes, and
// what scene files may say of it. Normal maps.
#include "kernel_test.h"

#include "base/error.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <span>
#include <string>

using namespace kernel_test;

namespace {

constexpr const char* kSheet =
    "objects: [{name: sheet, mesh: {positions: [[-1,-1,0],[1,-1,0],[1,1,0],[-1,1,0]], uvs: [[0,0],[1,0],"
    "[1,1],[0,1]], faces: [[0,1,2,3]]}, material: m}]\n";
constexpr const char* kParts =
    "  a: {type: diffuse, reflectance: 0.1}\n  b: {type: diffuse, reflectance: 0.2}\n"
    "  c: {type: mirror, reflectance: 0.3}\n  glass: {type: dielectric, ior: 1.5}\n"
    "  veil: {type: diffuse, reflectance: 0.1, opacity: 0.5}\n";

std::string sceneWith(const std::string& materials) {
    return fmt::format("crt: 1\nmaterials:\n{}{}{}", kParts, materials, kSheet);
}

/// The errors of a scene; empty: none.
std::string refusal(const std::string& materials) {
    try {
        (void)crt::parseScene(sceneWith(materials), "scene.yaml", "");
    } catch (const crt::Error& error) {
        CHECK(error.kind() == crt::ErrorKind::Scene);
        return error.what();
    }
    return {};
}

bool says(const std::string& text, const std::string& words) {
    return text.find(words) != std::string::npos;
}

/// A sampler whose one-dimensional numbers go through (0, 1) as the sample does.
CrtSampler samplerAt(std::uint64_t sample) {
    return crt_sampler_begin(CRT_SAMPLER_SOBOL, 0, crt_seed(1, 2), 3, sample);
}

/// A scene's sheet, hit in its middle.
struct Sheet {
    crt::CompiledScene compiled;
    CrtContext ctx;
    CrtHit hit = crt_no_hit(CRT_INFINITY);

    explicit Sheet(const std::string& materials)
        : compiled(crt::compileScene(crt::parseScene(sceneWith(materials), "scene.yaml", ""), 0)),
          ctx(contextOf(compiled)) {
        hit.t = 1;
        hit.slot = hit.id = 0;
        hit.b1 = 0.25f;
        hit.b2 = 0.125f;
    }
    std::string chosen(const vec3& d, std::uint64_t sample) const {
        const CrtSurface surface = crt_surface(&ctx, hit);
        CrtSampler sampler = samplerAt(sample);
        const char* const names[] = {"a", "b", "c", "glass", "veil"};
        const u32 dimension = crt_vertex_dimension(0) + CRT_DIM_MIX;
        return names[crt_chosen_material(&ctx, &surface, d, &sampler, dimension)];
    }
    /// Of 2^14 samples, the share that finds this material.
    double share(const std::string& material, const vec3& d) const {
        double found = 0;
        for (std::uint64_t i = 0; i < 1u << 14; ++i) found += chosen(d, i) == material;
        return found / (1u << 14);
    }
};

const vec3 kFromFront = make_vec3(0, 0, -1), kFromBack = make_vec3(0, 0, 1);

}  // namespace

TEST_CASE("mix: each material is found as often as the amounts say", "[composition]") {
    // One number of the sequence for all of the choices: stratified, so that shares are nearly exact.
    const Sheet deep(
        "  x: {type: mix, materials: [a, b], amount: 0.25}\n"
        "  y: {type: mix, materials: [x, c], amount: 0.5}\n"
        "  m: {type: mix, materials: [a, y], amount: 0.75}\n");
    CHECK(deep.share("a", kFromFront) == Approx(0.25 + 0.75 * 0.5 * 0.75).margin(3e-4));
    CHECK(deep.share("b", kFromFront) == Approx(0.75 * 0.5 * 0.25).margin(3e-4));
    CHECK(deep.share("c", kFromBack) == Approx(0.75 * 0.5).margin(3e-4));

    CHECK(Sheet("  m: {type: mix, materials: [a, b], amount: 0}\n").share("a", kFromFront) == 1);
    CHECK(Sheet("  m: {type: mix, materials: [a, b], amount: 1}\n").share("b", kFromFront) == 1);
    // The rest of the number after a choice never falls on a share of 0 or beyond one of 1.
    const Sheet sure(
        "  x: {type: mix, materials: [b, c], amount: 0}\n  y: {type: mix, materials: [c, b], amount: 1}\n"
        "  m: {type: mix, materials: [x, y], amount: 0.3}\n");
    CHECK(sure.share("b", kFromFront) == 1);
    // (u, v) = (3/8, 1/8): square (1, 0) of the checker.
    CHECK(Sheet("  m: {type: mix, materials: [a, b], amount: {checker: [0, 0.625], scale: 4}}\n")
              .share("b", kFromFront) == Approx(0.625).margin(3e-4));
}

TEST_CASE("two_sided: each side has its material", "[composition]") {
    const Sheet sheet("  m: {type: two_sided, front: a, back: c}\n");
    CHECK(sheet.share("a", kFromFront) == 1);
    CHECK(sheet.share("c", kFromBack) == 1);
    // Seen along its plane it is the front.
    CHECK(sheet.share("a", make_vec3(1, 0, 0)) == 1);
}

TEST_CASE("opacity: rays pass as often as it says, and go on behind the surface", "[composition]") {
    for (const double opacity : {0.0, 0.3, 1.0}) {
        const Sheet sheet(fmt::format("  m: {{type: diffuse, reflectance: 0.5, opacity: {}}}\n", opacity) +
                          "  other: {type: mix, materials: [a, b], opacity: 0.5}\n");
        CrtContext ctx = sheet.ctx;
        double stopped = 0;
        constexpr std::uint64_t kSamples = 1u << 14;
        if (opacity == 1) {  // nothing in the scene is composed, and nothing needs it
            CHECK(ctx.scene->compositions.count == 0);
            continue;
        }
        for (std::uint64_t i = 0; i < kSamples; ++i) {
            CrtSampler sampler = samplerAt(i);
            CrtRay ray;
            ray.o = make_vec3(-0.25f, -0.5f, 1);
            ray.d = kFromFront;
            ray.reach = CRT_INFINITY;
            CrtPassage way =
                crt_passage(CRT_PASSING_DIMENSION(0, 0), 0, kFromFront, splat4(0), 0u, splat4(1));
            way.passed = static_cast<u32>(i & 7);
            if (!crt_passes(&ctx, sheet.hit, &sampler, &way, &ray)) {
                ++stopped;
                continue;
            }
            CHECK(ray.o.z < 0);
            CHECK(ray.o.z > -1e-5f);
            CHECK(ray.reach == CRT_INFINITY);
        }
        CHECK(stopped / kSamples == Approx(opacity).margin(0.01));
    }
}

TEST_CASE("opacity: a shadow ray goes on to where it went", "[composition]") {
    const Sheet sheet("  m: {type: diffuse, reflectance: 0.5, opacity: 0}\n");
    Random random(5);
    for (int i = 0; i < 1000; ++i) {
        const CrtSurface surface = crt_surface(&sheet.ctx, sheet.hit);
        const vec3 end = make_vec3(static_cast<f32>(random.uniform(-1, 1)),
                                   static_cast<f32>(random.uniform(-1, 1)),
                                   static_cast<f32>(random.uniform(-1, -0.01)));
        // Through the surface's point; how far before its end it stops is a share of its length.
        CrtRay ray;
        ray.o = surface.p + (surface.p - end) * static_cast<f32>(random.uniform(0.1, 3));
        ray.d = end - ray.o;
        ray.reach = 0.9999f;
        const CrtRay behind = crt_ray_behind(ray, surface.p, surface.clearance, surface.ng);
        const vec3 stop = ray.o + ray.d * ray.reach, also = behind.o + behind.d * behind.reach;
        CHECK(behind.o.z < 0);
        CHECK(length(minus(toDouble(stop), toDouble(also))) < 2e-6);
    }
    // One that ends within the surface's clearance has nothing before it.
    const CrtSurface surface = crt_surface(&sheet.ctx, sheet.hit);
    CrtRay ray;
    ray.o = surface.p + make_vec3(0, 0, 1);
    ray.d = make_vec3(0, 0, -1 - 0.25f * surface.clearance);
    ray.reach = 1;
    CHECK(crt_ray_behind(ray, surface.p, surface.clearance, surface.ng).reach <= 0);
}

TEST_CASE("mix: what a scene may not say", "[composition][yaml]") {
    CHECK(refusal("  m: {type: mix, materials: [a, b]}\n").empty());
    // Parts may come later in the file.
    CHECK(refusal("  m: {type: mix, materials: [z, b]}\n"
                  "  z: {type: two_sided, front: a, back: c}\n")
              .empty());

    const std::string cyclic = refusal("  m: {type: mix, materials: [a, z]}\n"
                                       "  z: {type: two_sided, front: c, back: m}\n");
    CHECK(says(cyclic, "scene.yaml:9:40: error: material 'm' is made of itself: 'm' of 'z' of 'm'"));
    CHECK(says(refusal("  m: {type: mix, materials: [a, m]}\n"), "'m' of 'm'"));
    const std::string unknown = refusal("  m: {type: mix, materials: [a, glas]}\n");
    CHECK(says(unknown, "scene.yaml:8:33: error: there is no material 'glas'"));
    CHECK(says(unknown, "glass"));
    CHECK(says(refusal("  m: {type: mix, materials: [a, b, c]}\n"), "a mix needs two materials, not 3"));
    CHECK(says(refusal("  m: {type: mix, materials: [a]}\n"), "not 1"));
    CHECK(says(refusal("  m: {type: mix, materials: a}\n"), "expected a list"));
    CHECK(says(refusal("  m: {type: mix, materials: [a, b], amount: 1.5}\n"), "'amount'"));
    CHECK(says(refusal("  m: {type: mix}\n"), "'materials' is missing"));
    CHECK(says(refusal("  m: {type: two_sided, front: a}\n"), "'back' is missing"));
    CHECK(says(refusal("  m: {type: two_sided, front: a, back: glass}\n"), "cannot be a side"));
    CHECK(says(refusal("  m: {type: mix, materials: [a, veil]}\n"), "give the opacity to 'm'"));
    CHECK(says(refusal("  m: {type: diffuse, reflectance: 1, opacity: -0.1}\n"), "'opacity'"));
    CHECK(says(refusal("  m: {type: dielectric, ior: 1.5, absorption: 2, opacity: 0.5}\n"), "be closed"));

    // Of glass with one inside, and with two.
    const auto mixOf = [](const char* one, const char* other) {
        return fmt::format(
            "  one: {{type: dielectric, {}}}\n  other: {{type: rough_dielectric, roughness: 0.3, "
            "{}}}\n  inner: {{type: mix, materials: [b, other]}}\n"
            "  m: {{type: mix, materials: [one, inner]}}\n",
            one, other);
    };
    CHECK(refusal(mixOf("ior: 1.5, absorption: 2", "ior: 1.5, absorption: 2")).empty());
    CHECK(says(refusal(mixOf("ior: 1.5", "ior: 1.6")), "glass 'one' and glass 'other'"));
    CHECK(says(refusal(mixOf("ior: 1.5, absorption: 2", "ior: 1.5")), "'absorption' differ"));

    // Eight deep, and nine.
    std::string chain = "  m: {type: mix, materials: [a, m1]}\n";
    for (int i = 1; i < 8; ++i)
        chain += fmt::format("  m{}: {{type: mix, materials: [a, {}]}}\n", i,
                             i < 7 ? "m" + std::to_string(i + 1) : "b");
    CHECK(refusal(chain).empty());
    CHECK(says(refusal("  n: {type: mix, materials: [m, a]}\n" + chain), "more than 8 deep"));
}

namespace {

/// One texel, of this direction.
crt::Texture mapOf(const crt::Vec3d& n) {
    auto image = std::make_shared<crt::TextureImage>();
    image->file = "one normal";
    image->width = image->height = 1;
    image->kind = crt::TexelKind::Normals;
    image->decode = [n](std::span<std::uint16_t> words) {
        for (std::size_t k = 0; k < 3; ++k)
            words[k] = static_cast<std::uint16_t>(std::lround((n[k] + 1) / 2 * 65535));
    };
    crt::Texture texture;
    texture.image = image;
    return texture;
}

}  // namespace

TEST_CASE("normal map: red leans to where u grows, green to where v grows", "[composition]") {
    Random random(8);
    const auto point = [&] {
        return crt::Vec3d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    };
    for (int i = 0; i < 200; ++i) {
        crt::Mesh mesh;
        mesh.positions = {point(), point(), point()};
        mesh.triangles = {{0, 1, 2}};
        mesh.uvs = {{random.uniform(), random.uniform()}, {random.uniform(), random.uniform()},
                    {random.uniform(), random.uniform()}};
        mesh.uv_index = mesh.triangles;
        const crt::Vec3d e1 = minus(mesh.positions[1], mesh.positions[0]),
                         e2 = minus(mesh.positions[2], mesh.positions[0]);
        const double u1 = mesh.uvs[1][0] - mesh.uvs[0][0], u2 = mesh.uvs[2][0] - mesh.uvs[0][0],
                     v1 = mesh.uvs[1][1] - mesh.uvs[0][1], v2 = mesh.uvs[2][1] - mesh.uvs[0][1];
        const double det = u1 * v2 - u2 * v1;
        const crt::Vec3d normal = cross(e1, e2);
        if (std::abs(det) < 0.05 || length(normal) < 0.2) continue;
        // Where u grows and v stays, and the other way round.
        const crt::Vec3d along_u = times(plus(times(e1, v2), times(e2, -v1)), 1 / det),
                         along_v = times(plus(times(e1, -u2), times(e2, u1)), 1 / det);
        for (const bool mirrored : {false, true}) {
            crt::Scene scene = sceneOf(mesh);
            scene.textures.push_back(mapOf(unit({0.6, 0, 0.8})));
            scene.textures.push_back(mapOf(unit({0, 0.6, 0.8})));
            if (mirrored) scene.objects[0].transforms[0][0] = -1;  // x
            scene.materials.resize(1);
            scene.objects[0].material = 0;
            const auto flip = [&](const crt::Vec3d& w) {
                return crt::Vec3d{mirrored ? -w[0] : w[0], w[1], w[2]};
            };
            for (const bool green : {false, true}) {
                scene.materials[0].normal_texture = green;
                const crt::CompiledScene compiled = crt::compileScene(scene, 0);
                const CrtContext ctx = contextOf(compiled);
                CrtHit hit = crt_no_hit(CRT_INFINITY);
                hit.slot = hit.id = 0;
                hit.b1 = hit.b2 = 0.3f;
                CrtSurface surface = crt_surface(&ctx, hit);
                const crt::Vec3d n = toDouble(surface.ng);
                vec3 wo = surface.ng;
                CrtBsdf bsdf{};
                crt_map_normal(&ctx, &surface, hit.slot, &wo, &bsdf);
                const crt::Vec3d mapped = toDouble(surface.ns);
                CHECK(bsdf.facet == 1);
                CHECK(dot(mapped, n) == Approx(0.8).margin(1e-3));
                // Green is upright on red, whatever angle u and v have.
                const crt::Vec3d u = unit(flip(along_u)), v = flip(along_v);
                const crt::Vec3d up = unit(minus(v, times(u, dot(u, v))));
                CHECK(dot(mapped, green ? up : u) == Approx(0.6).margin(1e-3));
            }
        }
    }
}

TEST_CASE("normal map: a viewer behind the facet sees it from its front", "[composition]") {
    Random random(9);
    crt::Mesh mesh;
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};  // its normal is +z
    mesh.triangles = mesh.uv_index = {{0, 1, 2}};
    mesh.uvs = {{0, 0}, {1, 0}, {0.5, 1}};
    crt::Scene scene = sceneOf(mesh);
    scene.textures.push_back(mapOf(unit({0.9, 0.1, 0.4})));
    scene.materials.resize(1);
    scene.materials[0].normal_texture = 0;
    scene.objects[0].material = 0;
    for (const bool transmits : {false, true}) {
        if (transmits) {
            scene.materials[0].type = crt::MaterialType::Dielectric;
            scene.materials[0].eta = crt::constantSpectrum(1.5);
        }
        const crt::CompiledScene compiled = crt::compileScene(scene, 0);
        const CrtContext ctx = contextOf(compiled);
        CrtHit hit = crt_no_hit(CRT_INFINITY);
        hit.slot = hit.id = 0;
        hit.b1 = hit.b2 = 0.3f;
        std::uint64_t behind = 0;
        for (int i = 0; i < 1000; ++i) {
            CrtSurface surface = crt_surface(&ctx, hit);
            const crt::Vec3d before = random.direction();
            const double front = before[2] > 0 ? 1 : -1;
            vec3 wo = toFloat(before);
            CrtBsdf bsdf{};
            crt_map_normal(&ctx, &surface, hit.slot, &wo, &bsdf);
            const crt::Vec3d facet = times(toDouble(surface.ns), front), after = toDouble(wo);
            CHECK(bsdf.facet == !transmits);
            if (transmits) {
                CHECK(length(minus(after, before)) < 1e-7);
                continue;
            }
            CHECK(dot(after, facet) > 0);
            CHECK(length(after) == Approx(1).margin(1e-6));
            CHECK(after[2] == Approx(before[2]).margin(1e-6));  // a wall is upright
            if (dot(before, facet) > 0) CHECK(length(minus(after, before)) < 1e-7);
            else ++behind;
        }
        CHECK((transmits || behind > 100));
    }
}
