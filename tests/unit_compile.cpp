// Scene → blob: the features that a scene needs, and those that are reported as left out.
//
// Over 450 lines: one test turns on every feature by itself.
#include "compiled_scenes.h"

#include "base/error.h"
#include "compile/distributions.h"
#include "compile/light_tree.h"
#include "render/session.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>

using namespace compile_test;

TEST_CASE("the mask names kinds, never values", "[compile]") {
    const std::uint64_t base = compiled(litFloor()).header().features;
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
    const std::uint64_t base = compiled(litFloor()).header().features;
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
    seen |= differs(CRT_FEATURE_INSTANCES | CRT_FEATURE_BVH, CRT_FEATURE_BRUTE_FORCE,
                    [](Scene& s) { s.objects[0].sharing = crt::Sharing::Always; });
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
    seen |= differs(CRT_FEATURE_SHAPES, 0, [](Scene& s) {
        s.meshes.emplace_back();
        s.objects.emplace_back().mesh = 2;
        s.objects.back().material = 0;
        s.objects.back().shape = crt::Quadric{};
    });
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
    seen |= differs(CRT_FEATURE_DIELECTRIC | CRT_FEATURE_MEDIA, 0, [&](Scene& s) {
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
    const auto brushed = [&](double roughness) {
        return [=](Scene& s) {
            other(crt::MaterialType::RoughConductor)(s);
            s.materials[1].roughness = roughness;
            s.materials[1].anisotropy = 0.5;
        };
    };
    seen |= differs(CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_ANISOTROPY, 0, brushed(0.5));
    differs(CRT_FEATURE_ROUGH_CONDUCTOR, 0, brushed(0.01));  // a mirror
    const auto fuzzy = [&](double weight) {
        return [=](Scene& s) {
            s.materials[0].fuzz = weight;
            s.materials[0].fuzz_color = crt::constantSpectrum(0.5);
        };
    };
    seen |= differs(CRT_FEATURE_FUZZ, 0, fuzzy(0.5));
    differs(0, 0, fuzzy(0));
    // Fuzz on mirrors is worth sampling lights for.
    differs(CRT_FEATURE_FUZZ | CRT_FEATURE_MIRROR, CRT_FEATURE_DIFFUSE, [&](Scene& s) {
        fuzzy(1)(s);
        for (crt::Material& m : s.materials) m.type = crt::MaterialType::Mirror;
    });
    const auto coated = [&](double roughness, double index) {
        return [=](Scene& s) {
            s.materials[0].clearcoat = crt::Clearcoat{
                .ior = index, .roughness = roughness, .depth = crt::constantSpectrum(0.5)};
        };
    };
    seen |= differs(CRT_FEATURE_CLEARCOAT, 0, coated(0, 1.5));
    differs(CRT_FEATURE_CLEARCOAT | CRT_FEATURE_TABLE, 0, coated(0.5, 1.5));
    differs(CRT_FEATURE_CLEARCOAT, 0, coated(0.5, 1));  // its microfacets reflect nothing
    differs(CRT_FEATURE_CLEARCOAT | CRT_FEATURE_MIRROR, CRT_FEATURE_DIFFUSE, [&](Scene& s) {
        coated(0, 1.5)(s);
        for (crt::Material& m : s.materials) m.type = crt::MaterialType::Mirror;
    });
    const auto tinted = [&](crt::MaterialType type) {
        return [=](Scene& s) {
            other(type)(s);
            s.materials[1].tint = crt::constantSpectrum(0.5);
        };
    };
    seen |= differs(CRT_FEATURE_CONDUCTOR | CRT_FEATURE_TINT, 0, tinted(crt::MaterialType::Conductor));
    differs(CRT_FEATURE_DIELECTRIC, 0, tinted(crt::MaterialType::Dielectric));  // which has none
    // A texture of roughness needs tables of coats on gloss alone.
    const auto by_place = [&](crt::MaterialType type) {
        return [=](Scene& s) {
            other(type)(s);
            crt::Texture checker;
            checker.kind = crt::Texture::Kind::Checker;
            checker.values = {crt::TextureValue{crt::constantSpectrum(0.25), crt::kNoTexture},
                              crt::TextureValue{crt::constantSpectrum(0.75), crt::kNoTexture}};
            s.textures = {checker};
            s.materials[1].roughness_texture = 0;
        };
    };
    seen |= differs(CRT_FEATURE_PLASTIC | CRT_FEATURE_TABLE | CRT_FEATURE_TEXTURE | CRT_FEATURE_COAT_TEXTURE,
                    0, by_place(crt::MaterialType::Plastic));
    differs(CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_TEXTURE, 0,
            by_place(crt::MaterialType::RoughConductor));
    // Transmitting materials have none.
    differs(CRT_FEATURE_DIELECTRIC, 0, [&](Scene& s) {
        other(crt::MaterialType::Dielectric)(s);
        coated(0, 1.5)(s);
        s.materials[1].clearcoat = std::exchange(s.materials[0].clearcoat, std::nullopt);
    });
    const auto sheet = [&](crt::MaterialType type) {
        return [=](Scene& s) {
            other(type)(s);
            s.materials[1].transmittance = crt::constantSpectrum(0.5);
        };
    };
    seen |= differs(CRT_FEATURE_PLASTIC | CRT_FEATURE_TRANSLUCENT, 0, sheet(crt::MaterialType::Plastic));
    differs(CRT_FEATURE_MIRROR, 0, sheet(crt::MaterialType::Mirror));  // which lets nothing through
    // Its mapped normals are as interpolated ones.
    differs(CRT_FEATURE_PLASTIC | CRT_FEATURE_TRANSLUCENT | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE |
                CRT_FEATURE_SMOOTH_NORMALS,
            0, [&](Scene& s) {
                sheet(crt::MaterialType::Plastic)(s);
                s.textures.emplace_back().kind = crt::Texture::Kind::Checker;
                s.materials[1].normal_texture = 0;
            });
    const auto even = [] {
        crt::Texture texture;
        auto image = std::make_shared<crt::TextureImage>();
        image->width = image->height = 2;
        image->decode = [](std::span<std::uint16_t> words) { std::fill(words.begin(), words.end(), 32768); };
        texture.image = std::move(image);
        return texture;
    };
    differs(CRT_FEATURE_TEXTURE, 0, [&](Scene& s) {
        s.textures = {even()};
        s.materials[0].reflectance_texture = 0;
    });
    seen |= differs(CRT_FEATURE_TEXTURE | CRT_FEATURE_FACTOR, 0, [&](Scene& s) {
        s.textures = {even()};
        s.textures[0].factor = crt::TextureValue{crt::constantSpectrum(0.5), crt::kNoTexture};
        s.materials[0].reflectance_texture = 0;
    });
    seen |= differs(CRT_FEATURE_TEXTURE | CRT_FEATURE_FACTOR | CRT_FEATURE_EMISSION_IMAGE, 0, [&](Scene& s) {
        s.textures = {even()};
        s.textures[0].factor = crt::TextureValue{s.emissions[0].radiance, crt::kNoTexture};
        s.emissions[0].texture = 0;
    });
    const auto rough_base = [&](double roughness) {
        return [=](Scene& s) {
            other(crt::MaterialType::Plastic)(s);
            s.materials[1].diffuse_roughness = roughness;
        };
    };
    seen |= differs(CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_BASE | CRT_FEATURE_TABLE, 0, rough_base(0.5));
    differs(CRT_FEATURE_PLASTIC, 0, rough_base(1e-7));  // Lambert's, in single precision
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
    seen |= differs(CRT_FEATURE_SPLAT, 0,
                    [](Scene& s) { s.integrator.type = crt::IntegratorType::SplatTest; });
    const auto many = [](Scene& s) {  // each quad in a separate place
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
    seen |= compiled(litFloor(), crt::kAovDepth).header().features;
    CHECK(compiled(litFloor(), crt::kAovDepth).header().features == (base | CRT_FEATURE_AOV));
    // The film keeps these itself; the kernel need not know.
    CHECK(compiled(litFloor(), crt::kAovVariance | crt::kAovSamples).header().features == base);
    seen |= differs(CRT_FEATURE_TABLE, 0, [](Scene& s) { s.emissions[0].radiance[5] *= 2; });
    CHECK(seen == CRT_FEATURES_ALL);

    differs(0, CRT_FEATURE_NEE, [](Scene& s) { s.integrator.nee = false; });
    differs(CRT_FEATURE_DIELECTRIC, CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, makeGlass);
    differs(0, CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE, [](Scene& s) { s.objects[1].emission = -1; });
    differs(0, CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
            [](Scene& s) { s.emissions[0].radiance = crt::constantSpectrum(0); });
    // Nothing is scattered at depth 0.
    differs(0, CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, [](Scene& s) { s.integrator.max_depth = 0; });
    // As many as the state of a path can count.
    Scene endless = litFloor();
    endless.integrator.max_depth = 1'000'000'000;
    CHECK(compiled(endless).header().max_depth == CRT_MOST_EVENTS);
    // But the albedo is asked for.
    Scene flat = litFloor();
    flat.integrator.max_depth = 0;
    CHECK(compiled(flat, crt::kAovAlbedo).header().features ==
          ((base | CRT_FEATURE_AOV) & ~CRT_FEATURE_NEE));
    CHECK(compiled(flat, crt::kAovNormal).header().features ==
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
    CHECK(headerOf(compiled(room(false))).occluder_patches.count == 0);
    CHECK(headerOf(compiled(room(false))).patches.count == 6);  // of twelve triangles
    const CompiledScene screened = compiled(room(true));
    REQUIRE(headerOf(screened).occluders8.count == 1);
    const auto block = listOf<CrtTriangle8>(screened, headerOf(screened).occluders8)[0];
    CHECK(block.slot[0] == 12);
    CHECK(block.slot[1] == CRT_NONE);
    REQUIRE(headerOf(screened).occluder_patches.count == 1);
    CHECK(listOf<CrtPatch>(screened, headerOf(screened).occluder_patches)[0].slot[0] == 12);
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

TEST_CASE("the unit of splats is a power of two that follows the power of the lights", "[compile]") {
    CHECK(compiled(litFloor()).header().splat_scale == 0);
    Scene scene = litFloor();
    scene.integrator.type = crt::IntegratorType::SplatTest;
    const crt::CompiledScene once = compiled(scene);
    const double scale = once.header().splat_scale;
    int exponent = 0;
    CHECK(std::frexp(scale, &exponent) == 0.5);
    CHECK((once.header().aovs & CRT_AOV_SPLATS) != 0);
    for (double& value : scene.emissions[0].radiance.values) value *= 8;
    CHECK(compiled(scene).header().splat_scale == scale / 8);
    CHECK(compiled(scene).hash != once.hash);
    for (double& value : scene.emissions[0].radiance.values) value = 0;
    CHECK(compiled(scene).header().splat_scale == std::ldexp(1.0, 32));
    scene.film.spectral.bins = {400, 700, 30};
    CHECK_THROWS_WITH(compiled(scene), Contains("splat_test") && Contains("film.spectral"));
}
