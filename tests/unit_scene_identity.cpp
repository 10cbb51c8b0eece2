// Which scenes are the same to a film: their hash.
#include "compiled_scenes.h"

#include "base/error.h"
#include "compile/scene_identity.h"

#include <functional>
#include <set>
#include <string>

using namespace compile_test;

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
    const auto brush = [&](const char* what, double anisotropy, double rotation_deg) {
        differs(what, [=](Scene& s) {
            makeGlass(s);
            s.materials[0].type = crt::MaterialType::RoughDielectric;
            s.materials[0].roughness = 0.5;
            s.materials[0].anisotropy = anisotropy;
            s.materials[0].anisotropy_rotation_deg = rotation_deg;
        });
    };
    brush("brushed glass", 0.5, 0);
    brush("its anisotropy", 0.25, 0);
    brush("its direction", 0.5, 1);
    const auto color = [&](const char* what, double f0, double tint, double weight) {
        differs(what, [=](Scene& s) {
            s.materials[0].type = crt::MaterialType::RoughConductor;
            s.materials[0].roughness = 0.5;
            s.materials[0].by_color = true;
            s.materials[0].reflectance = crt::constantSpectrum(f0);
            s.materials[0].edge_tint = crt::constantSpectrum(tint);
            s.materials[0].weight = weight;
        });
    };
    color("metal by its colours", 0.5, 0.5, 1);
    color("its colour", 0.75, 0.5, 1);
    color("its tint", 0.5, 0.75, 1);
    color("its weight", 0.5, 0.5, 0.5);
    const auto fuzz = [&](const char* what, double weight, double color, double roughness) {
        differs(what, [=](Scene& s) {
            s.materials[0].fuzz = weight;
            s.materials[0].fuzz_color = crt::constantSpectrum(color);
            s.materials[0].fuzz_roughness = roughness;
        });
    };
    fuzz("fuzz", 0.5, 0.5, 0.5);
    fuzz("its weight", 0.75, 0.5, 0.5);
    fuzz("its colour", 0.5, 0.75, 0.5);
    fuzz("its roughness", 0.5, 0.5, 0.75);
    const auto coat = [&](const char* what, double ior, double roughness, double depth, double darkening,
                          double base) {
        differs(what, [=](Scene& s) {
            s.materials[0].clearcoat = crt::Clearcoat{.ior = ior,
                                                      .roughness = roughness,
                                                      .depth = crt::constantSpectrum(depth),
                                                      .darkening = darkening,
                                                      .base_roughness = base};
        });
    };
    coat("a coat", 1.5, 0.5, 0.5, 0.5, 0.5);
    coat("its index", 1.75, 0.5, 0.5, 0.5, 0.5);
    coat("its roughness", 1.5, 0.75, 0.5, 0.5, 0.5);
    coat("its colour", 1.5, 0.5, 0.75, 0.5, 0.5);
    coat("its darkening", 1.5, 0.5, 0.5, 0.75, 0.5);
    coat("the roughness below it", 1.5, 0.5, 0.5, 0.5, 0.75);
    for (const double roughness : {0.5, 0.75})
        differs("a rough base", [=](Scene& s) {
            s.materials[0].type = crt::MaterialType::Plastic;
            s.materials[0].eta = crt::constantSpectrum(1);
            s.materials[0].diffuse_roughness = roughness;
        });
    differs("a glossy base", [](Scene& s) {
        s.materials[0].type = crt::MaterialType::Plastic;
        s.materials[0].eta = crt::constantSpectrum(1.5);
        s.materials[0].by_color = true;
    });
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
        if (accelerator == crt::Accelerator::None) CHECK(other.header().features != tree.header().features);
    }
}

TEST_CASE("a better tree and a smaller kernel leave the hash alone", "[compile]") {
    const Scene scene = [] {
        Scene s = litFloor();
        s.integrator.accelerator = crt::Accelerator::Bvh;
        return s;
    }();
    CompiledScene c = compiled(scene);
    CrtScene& header = c.header();
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
