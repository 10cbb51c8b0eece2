// The record of a film about its scene (film_record.h), and its use in files.
#include "catch.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "film/film_record.h"
#include "film/resolve.h"
#include "hostile_numbers.h"
#include "image/image_io.h"
#include "image/image_metadata.h"
#include "render/light_checks.h"
#include "render/outputs.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>
#include <cmath>

using namespace crt;

namespace {

const std::string kScene = R"(crt: 1
title: "Röhre"
camera: {position: [1, 2, -4], target: [0.5, 0, 3], fov: 40}
film: {resolution: [64, 48], crop: [8, 4, 40, 36], white_balance: glow, exposure_ev: 0.1}
sampler: {seed: 18446744073709551615}
spectra: {glow: {blackbody: 4000, scale: 5}}
materials: {floor: {type: diffuse, reflectance: 0.7}, glass: {type: dielectric, ior: 1.5}}
objects:
  - name: floor
    mesh: {positions: [[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], faces: [[0, 1, 2, 3]]}
    material: floor
  - name: lamp
    mesh: {positions: [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], faces: [[0, 1, 2, 3]]}
    material: floor
    emission: {radiance: glow}
outputs: [{file: a.exr, aovs: [depth, error]}]
)";

Scene parsed(const std::vector<SceneOverride>& overrides = {}) {
    return parseScene(kScene, "scene.yaml", ".", overrides);
}

/// p · M, divided by its fourth component.
Vec3d transformed(const Vec3d& p, const RowMatrix4d& m) {
    std::array<double, 4> r{};
    for (std::size_t c = 0; c < 4; ++c) r[c] = p[0] * m[c] + p[1] * m[4 + c] + p[2] * m[8 + c] + m[12 + c];
    return {r[0] / r[3], r[1] / r[3], r[2] / r[3]};
}

Film oneColor(std::uint32_t width, std::uint32_t height, const Vec3d& xyz) {
    constexpr std::uint32_t kAovs = kAovSquares;
    Film film({width, height, channelsFor(kAovs), kAovs});
    for (std::size_t p = 0; p < film.counts.size(); ++p) {
        film.counts[p] = 2;
        double* sums = &film.sums[p * film.shape().channels * 2];
        for (std::size_t c = 0; c < 3; ++c) sums[2 * c] = 2 * xyz[c];
        sums[2 * firstChannel(kAovs, kAovSquares)] =
            2.5 * xyz[1] * xyz[1];  // Y²: one sample of 1.5 times and one of half the mean.
    }
    film.samples.add({0, 2});
    return film;
}

}  // namespace

TEST_CASE("a record comes back from its text with every bit", "[develop]") {
    FilmRecord record = recordOf(parsed());
    record.backend = "embree 1.0";
    record.device = "a processor";
    record.date_utc = "2026:11:22 05:40:00";
    record.complete = false;
    const FilmRecord back = readRecord(recordText(record));
    CHECK(back.title == "Röhre");
    CHECK(back.seed == 18446744073709551615ull);
    CHECK(back.window == std::array<int, 4>{8, 4, 40, 36});
    CHECK(back.width == 64);
    CHECK(back.height == 48);
    CHECK(back.aovs == (kAovDepth | kAovError));
    CHECK(back.development == record.development);
    CHECK(back.development.white);
    CHECK(back.whites == record.whites);
    CHECK(back.whites.count("glow") == 1);
    CHECK(back.world_to_camera == record.world_to_camera);
    CHECK(back.world_to_ndc == record.world_to_ndc);
    CHECK(back.traits == record.traits);
    CHECK(back.backend == record.backend);
    CHECK(back.device == record.device);
    CHECK(back.date_utc == record.date_utc);
    CHECK(back.complete == record.complete);
    CHECK(back.paths.independent == record.paths.independent);
    CHECK(readRecord(recordText(recordOf(parsed({{"sampler.type", "independent"}})))).paths.independent);
    CHECK(recordText(back) == recordText(record));
}

TEST_CASE("a number of a record is read as it stands, or refused", "[develop]") {
    Scene scene = parsed();
    scene.film.spectral.bins = {400, 700, 30};
    requireNumbersReadOrRefused(recordText(recordOf(scene)),
                                [](const std::string& text) { return recordText(readRecord(text)); });
}

TEST_CASE("a text that is no record is refused, whatever of it is missing or wrong", "[develop]") {
    const std::string whole = recordText(recordOf(parsed()));
    for (const char* key :
         {"title", "seed", "independent_samples", "resolution", "window", "aovs", "development",
          "lights_xyz", "world_to_camera", "world_to_ndc", "traits", "backend", "device", "date_utc",
          "exposure_ev", "color_space", "apply_to_float"}) {
        INFO(key);
        std::string without = whole;
        const std::size_t at = without.find(fmt::format("\"{}\"", key));
        REQUIRE(at != std::string::npos);
        without[at + 1] = '_';
        CHECK_THROWS_AS(readRecord(without), Error);
    }
    const auto with = [&](const std::string& what, const std::string& instead) {
        std::string text = whole;
        REQUIRE(text.find(what) != std::string::npos);
        return text.replace(text.find(what), what.size(), instead);
    };
    CHECK_THROWS_AS(readRecord(with("\"exposure_ev\":0.1", "\"exposure_ev\":1e9")), Error);
    // The message says of what is no number what it is, not all of it.
    const std::string seed = "\"seed\":18446744073709551615", long_text(100000, 'x');
    CHECK_THROWS_WITH(readRecord(with(seed, "\"seed\":\"" + long_text + '"')),
                      "has string where a whole number from 0 to 18446744073709551615 is expected");
    CHECK_THROWS_WITH(readRecord(with(seed, "\"seed\":-1")),
                      "has -1 where a whole number from 0 to 18446744073709551615 is expected");
    CHECK_THROWS_AS(readRecord(with("\"color_space\":\"srgb\"", "\"color_space\":\"cmyk\"")), Error);
    CHECK_THROWS_AS(readRecord(with("\"window\":[8,4,40,36]", "\"window\":[8,4,80,36]")), Error);
    CHECK_THROWS_AS(readRecord(with("\"window\":[8,4,40,36]", "\"window\":[8,4,8,36]")), Error);
    // A scene of that size is refused with the exit code of scenes, and this is a film.
    const std::size_t resolution = whole.find("\"resolution\":[");
    const std::string whole_film = whole.substr(resolution, whole.find(']', resolution) + 1 - resolution);
    CHECK_THROWS_AS(readRecord(with(whole_film, "\"resolution\":[65536,64]")), Error);
    CHECK_NOTHROW(readRecord(with(whole_film, "\"resolution\":[65535,64]")));
    CHECK_THROWS_AS(readRecord(""), Error);
    CHECK_THROWS_AS(readRecord(std::string(100000, '[')), Error);
}

TEST_CASE(
    "files of floats hold the radiance of the scene, display "
    "formats what exposure and white balance make of it",
    "[develop]") {
    const Scene scene = parsed();
    const Vec3d color{0.4, 0.5, 0.2};
    const Film film = oneColor(32, 32, color);
    FilmIdentity identity{.scene_hash = "h", .version = "v", .record = recordOf(scene)};
    const auto image = [&](OutputFormat format) {
        return developedImage({.file = "a", .format = format, .aovs = kAovError, .place = {}}, film,
                              identity);
    };
    const Image plain = resolveImage(film, {}, kAovError);
    const Image shown = resolveImage(film, developmentOf(scene), kAovError);
    REQUIRE(plain.pixels != shown.pixels);
    for (const OutputFormat format : {OutputFormat::Exr, OutputFormat::Pfm}) {
        const Image floats = image(format);
        CHECK(floats.pixels == plain.pixels);  // StdError.Y among them.
        CHECK(metadataValue(floats, kExposureKey) == "0");
        CHECK(metadataValue(floats, kWhiteBalanceKey) == "none");
        CHECK(metadataValue(floats, kDisplayExposureKey) == "0.1");
        CHECK(metadataValue(floats, kDisplayWhiteBalanceKey) == whiteBalanceText(developmentOf(scene)));
        REQUIRE(floats.adopted_neutral);
        CHECK((*floats.adopted_neutral)[0] == Approx(0.3804).margin(1e-3));  // A black body of 4000 K.
    }
    for (const OutputFormat format : {OutputFormat::Png, OutputFormat::Jpeg, OutputFormat::Ppm}) {
        const Image display = image(format);
        CHECK(display.pixels == shown.pixels);
        CHECK(metadataValue(display, kExposureKey) == "0.1");
        CHECK(metadataValue(display, kDisplayExposureKey).empty());
    }
    identity.record->development.apply_to_float = true;
    for (const OutputFormat format :
         {OutputFormat::Exr, OutputFormat::Pfm, OutputFormat::Png, OutputFormat::Ppm}) {
        const Image all = image(format);
        CHECK(all.pixels == shown.pixels);
        CHECK(metadataValue(all, kExposureKey) == "0.1");
        CHECK_FALSE(all.adopted_neutral);
    }
}

TEST_CASE("a part of a film is the film of that part", "[develop]") {
    const std::uint32_t aovs = kAovDepth | kAovPrimitive;
    Film film({5, 4, channelsFor(aovs), aovs});
    for (std::size_t i = 0; i < film.sums.size(); ++i) film.sums[i] = static_cast<double>(i);
    for (std::size_t p = 0; p < 20; ++p)
        film.counts[p] = 100 + p, film.primitives[p] = static_cast<std::uint32_t>(p);
    film.samples.add({3, 9});
    const Film part = cropped(film, {1, 2, 4, 4});
    CHECK(part.shape() == FilmShape{3, 2, channelsFor(aovs), aovs});
    CHECK(part.samples.text() == "3-9");
    for (std::uint32_t y = 0; y < 2; ++y)
        for (std::uint32_t x = 0; x < 3; ++x) {
            for (std::uint32_t c = 0; c < film.shape().channels; ++c)
                CHECK(part.sum(x, y, c) == film.sum(x + 1, y + 2, c));
            CHECK(part.counts[y * 3 + x] == film.counts[(y + 2) * 5 + x + 1]);
            CHECK(part.primitives[y * 3 + x] == film.primitives[(y + 2) * 5 + x + 1]);
        }
    CHECK_THROWS_AS(cropped(film, {1, 2, 6, 4}), Error);
    CHECK_THROWS_AS(cropped(film, {1, 2, 1, 4}), Error);
}

TEST_CASE("the matrices of the camera put points where its pixels see them", "[develop]") {
    const Scene scene = parsed();
    const FilmRecord record = recordOf(scene);
    const Camera& camera = scene.camera;
    const Vec3d d{camera.target[0] - camera.position[0], camera.target[1] - camera.position[1],
                  camera.target[2] - camera.position[2]};
    const double distance = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const auto near = [](const Vec3d& a, const Vec3d& b) {
        for (std::size_t k = 0; k < 3; ++k)
            if (std::abs(a[k] - b[k]) > 1e-12 * 10) return false;
        return true;
    };
    CHECK(near(transformed(camera.position, record.world_to_camera), {0, 0, 0}));
    CHECK(near(transformed(camera.target, record.world_to_camera), {0, 0, -distance}));
    const Vec3d centre = transformed(camera.target, record.world_to_ndc);
    CHECK(centre[0] == Approx(0.5));
    CHECK(centre[1] == Approx(0.5));

    // The ray of a film position is what core/compile/settings.cpp makes of it: corner + x · step_x + y ·
    // step_y.
    const CompiledScene compiled = compileScene(scene, 0);
    const kernel::CrtCamera& rays = compiled.header().camera;
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {64.0, 0.0}, {0.0, 48.0}, {20.5, 40.25}}) {
        Vec3d p{};
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = camera.position[k] + 7 * (rays.corner[k] + x * rays.step_x[k] + y * rays.step_y[k]);
        const Vec3d ndc = transformed(p, record.world_to_ndc);
        CHECK(ndc[0] == Approx(x / 64).margin(1e-6));
        CHECK(ndc[1] == Approx(y / 48).margin(1e-6));
        const Vec3d seen = transformed(p, record.world_to_camera);
        CHECK(seen[2] == Approx(-7).epsilon(1e-6));
        CHECK(seen[0] == Approx((2 * x / 64 - 1) * 7 * camera.tan_half_width).margin(1e-5));
        CHECK(seen[1] == Approx((1 - 2 * y / 48) * 7 * camera.tan_half_height).margin(1e-5));
    }
}

TEST_CASE("whatever makes a film another one is said in words", "[develop]") {
    const Scene scene = parsed();
    const std::string hash = compileScene(scene, requestedAovs(scene)).hash;
    const FilmRecord record = recordOf(scene);
    const std::vector<std::pair<SceneOverride, std::string>> changes{
        {{"film.resolution", "[128, 96]"}, "the resolution is 64 × 48, not 128 × 96"},
        {{"film.crop", "null"}, "the crop window is [8, 4, 40, 36], not the whole film"},
        {{"film.filter", "gaussian"}, "the filter is box of radius 0.5, not gaussian"},
        {{"sampler.seed", "3"}, "the seed is 18446744073709551615, not 3"},
        {{"sampler.type", "independent"}, "the sampler is sobol, not independent"},
        {{"sampler.replicates", "8"}, "the replicates are 2, not 8"},
        {{"integrator.type", "normals"}, "the integrator is path, not normals"},
        {{"integrator.max_depth", "3"}, "max_depth is 16, not 3"},
        {{"integrator.roulette", "false"}, "roulette is on from depth 4, not off"},
        {{"integrator.roulette_depth", "7"}, "roulette is on from depth 4, not on from depth 7"},
        {{"integrator.nee", "false"}, "nee is on, not off"},
        {{"integrator.mis", "false"}, "mis is on, not off"},
        {{"camera.fov", "41"}, "the camera is at"},
        {{"camera.position", "[1, 2, -4.0000001]"}, "not at (1, 2, -4.0000001)"},
        {{"camera.aperture_radius", "0.1"}, "lens of radius 0.1"},
        {{"objects.0.mesh.positions.0.0", "-2.5"},
         "the geometry differs (4 triangles in 2 objects in both)"},
        {{"objects.0.transform", "[{translate: [0, 0.5, 0]}]"}, "the geometry differs"},
        {{"objects.0.material", "glass"}, "the geometry differs"},
        {{"materials.floor.reflectance", "0.6"}, "the materials differ (2 materials in both)"},
        {{"spectra.glow.scale", "6"}, "the light differs"},
        {{"objects.1.emission.two_sided", "true"}, "the light differs"},
        {{"environment", "{radiance: 1}"},
         "the light is 1 kind of lamp, no environment, not 1 kind of lamp, an environment"},
        {{"outputs.0.aovs", "[normal]"}, "the AOVs of first hits are depth, not normal"},
    };
    for (const auto& [change, words] : changes) {
        INFO(change.path << " = " << change.value);
        const Scene other = parsed({change});
        CHECK(compileScene(other, requestedAovs(other)).hash != hash);
        const std::vector<std::string> differences = differingTraits(record, recordOf(other));
        std::string all;
        for (const std::string& difference : differences) all += difference + "; ";
        CHECK_THAT(all, Contains(words));
    }
    // Settings that do not affect samples are no difference.
    for (const SceneOverride& change : {SceneOverride{"film.exposure_ev", "2"},
                                        {"film.color_space", "xyz"},
                                        {"title", "other"},
                                        {"sampler.samples", "7"}}) {
        const Scene other = parsed({change});
        CHECK(compileScene(other, requestedAovs(other)).hash == hash);
        CHECK(differingTraits(record, recordOf(other)).empty());
    }
}

TEST_CASE("a material that makes a film another one is given as the reason, whatever of it changed",
          "[develop]") {
    using crt::constantSpectrum;
    using crt::Material;
    using crt::MaterialType;
    struct Change {
        const char* what;
        MaterialType type;
        void (*change)(Material&);
    };
    const Change changes[] = {
        {"type", MaterialType::Diffuse, [](Material& m) { m.type = MaterialType::Mirror; }},
        {"reflectance", MaterialType::Diffuse, [](Material& m) { m.reflectance = constantSpectrum(0.3); }},
        {"reflectance texture", MaterialType::Diffuse, [](Material& m) { m.reflectance_texture = 0; }},
        {"opacity", MaterialType::Diffuse, [](Material& m) { m.opacity = 0.5; }},
        {"opacity texture", MaterialType::Diffuse, [](Material& m) { m.opacity_texture = 0; }},
        {"fuzz", MaterialType::Diffuse, [](Material& m) { m.fuzz = 0.5; }},
        {"coat", MaterialType::Diffuse,
         [](Material& m) { m.clearcoat = crt::Clearcoat{.depth = constantSpectrum(0.1)}; }},
        {"eta", MaterialType::Conductor, [](Material& m) { m.eta = constantSpectrum(0.3); }},
        {"k", MaterialType::Conductor, [](Material& m) { m.k = constantSpectrum(4); }},
        {"film", MaterialType::Conductor, [](Material& m) { m.film_thickness_nm = 200; }},
        {"roughness", MaterialType::RoughConductor, [](Material& m) { m.roughness = 0.6; }},
        {"roughness texture", MaterialType::RoughConductor, [](Material& m) { m.roughness_texture = 0; }},
        {"roughness texture of gloss", MaterialType::Plastic, [](Material& m) { m.roughness_texture = 0; }},
        {"roughness texture of a coat", MaterialType::Plastic,
         [](Material& m) { m.clearcoat = crt::Clearcoat{.roughness_texture = 0, .depth = {}}; }},
        {"tint", MaterialType::RoughConductor, [](Material& m) { m.tint = constantSpectrum(0.5); }},
        {"tint texture", MaterialType::RoughConductor, [](Material& m) { m.tint_texture = 0; }},
        {"transmittance", MaterialType::Plastic,
         [](Material& m) { m.transmittance = constantSpectrum(0.25); }},
        {"transmittance texture", MaterialType::Plastic, [](Material& m) { m.transmittance_texture = 0; }},
        {"anisotropy", MaterialType::RoughConductor, [](Material& m) { m.anisotropy = 0.5; }},
        {"colours", MaterialType::RoughConductor, [](Material& m) { m.by_color = true; }},
        {"absorption", MaterialType::Dielectric, [](Material& m) { m.absorption = constantSpectrum(1); }},
        {"rough base", MaterialType::Plastic,
         [](Material& m) {
             m.by_color = true;
             m.diffuse_roughness = 0.5;
         }},
    };
    for (const Change& c : changes) {
        INFO(c.what);
        Scene scene = parsed();
        crt::Texture checker;
        checker.kind = crt::Texture::Kind::Checker;
        checker.values = {crt::TextureValue{constantSpectrum(0.25), crt::kNoTexture},
                          crt::TextureValue{constantSpectrum(0.75), crt::kNoTexture}};
        scene.textures.push_back(checker);
        Material& material = scene.materials[0];
        material.type = c.type;
        material.reflectance = material.edge_tint = material.fuzz_color = constantSpectrum(0.5);
        material.eta = material.film_index = constantSpectrum(1.4);
        material.k = constantSpectrum(3);
        material.roughness = 0.4;
        Scene other = scene;
        c.change(other.materials[0]);
        CHECK(compileScene(other, requestedAovs(other)).hash !=
              compileScene(scene, requestedAovs(scene)).hash);
        const std::vector<std::string> differences = differingTraits(recordOf(scene), recordOf(other));
        REQUIRE(differences.size() == 1);
        CHECK_THAT(differences[0], Contains("the materials differ"));
    }
}

TEST_CASE("a lamp with nothing in front of it is named, and no other", "[develop]") {
    const auto named = [](const std::vector<SceneOverride>& changes) { return idleLamps(parsed(changes)); };
    const std::vector<std::string> lamp{"'lamp'"};
    const SceneOverride away{"objects.1.mesh.faces", "[[3, 2, 1, 0]]"};
    CHECK(named({}).empty());
    // The camera at height 2 is in the plane of the lamp, and not in front of it.
    CHECK(named({away}) == lamp);
    CHECK(named({away, {"camera.position", "[1, 2.5, -4]"}}).empty());
    CHECK(named({away, {"camera.aperture_radius", "0.1"}}).empty());
    CHECK(named({away, {"objects.1.emission.two_sided", "true"}}).empty());
    CHECK(named({away, {"integrator.type", "normals"}}).empty());
    CHECK(named({away, {"objects.0.transform", "[{translate: [0, 2, 0]}]"}}) == lamp);   // In its plane.
    CHECK(named({away, {"objects.0.transform", "[{translate: [0, 2.001, 0]}]"}}).empty());
    CHECK(named({away, {"objects.0.transform", "[{rotate: {axis: [1, 0, 0], angle_deg: 80}}]"}}) == lamp);
    CHECK(
        named({away,
               {"objects.0.transform", "[{rotate: {axis: [1, 0, 0], angle_deg: 80}}, {scale: [1, 2, 1]}]"}})
            .empty());
    // A mirroring transform keeps the outside outside.
    CHECK(named({{"objects.1.transform", "[{scale: [-1, 1, 1]}]"}}).empty());
    CHECK(named({away, {"objects.1.transform", "[{scale: [-1, 1, 1]}]"}}) == lamp);
    CHECK(named({{"objects.1.transform", "[{scale: [1, -1, 1]}]"}}).empty());  // At −2, it lights upwards.
    // Tilted, at rounding's mercy: its own corners are not in front of it.
    for (int degrees = 1; degrees < 30; degrees += 3)
        CHECK(named({away,
                     {"objects.1.transform",
                      "[{rotate: {axis: [1, 0, 0.3], angle_deg: " + std::to_string(degrees) +
                          "}}, {translate: [0, 9, 0]}]"}}) == lamp);
}

TEST_CASE("a film is black when no pixel has any of X, Y and Z", "[develop]") {
    for (std::size_t c = 0; c < 3; ++c) {
        Film film = oneColor(7, 5, {0, 0, 0});
        CHECK(isBlack(film));
        film.sums[(34 * film.shape().channels + c) * 2] = 1e-300;
        CHECK_FALSE(isBlack(film));
    }
}

TEST_CASE("color_error is the spread of the replicates' colours, in the colours of the image", "[develop]") {
    // Two replicates of three samples each, whose means are (1, 2, 3) and (2, 2, 7): the mean of both has a
    // standard error of half their difference.
    constexpr std::uint32_t aovs = kAovReplicates | kAovColorError;
    Film film({1, 1, channelsFor(aovs, 2), aovs});
    REQUIRE(film.replicates() == 2);
    const auto set = [&film](std::uint32_t channel, double sum) { film.sums[2 * channel] = sum; };
    const std::uint32_t first = firstChannel(aovs, kAovReplicates);
    for (const auto& [channel, sum] : {std::pair{0u, 9.0}, {1u, 12.0}, {2u, 30.0}, {first, 6.0},
                                       {first + 1, 3.0}, {first + 2, 9.0}})
        set(channel, sum);
    film.counts = {6};
    film.samples.add({0, 6});
    Development development;
    development.color_space = ColorSpace::Xyz;
    development.exposure_ev = 1;
    const Image image = resolveImage(film, development, kAovColorError);
    REQUIRE(image.channels == std::vector<std::string>{"R", "G", "B", "StdError.R", "StdError.G",
                                                       "StdError.B"});
    CHECK(image.pixels[0] == Approx(3));
    CHECK(image.pixels[3] == Approx(1));
    CHECK(image.pixels[4] == Approx(0).margin(1e-12));
    CHECK(image.pixels[5] == Approx(4));
    // In sRGB red is 3.2406 X - 1.5372 Y - 0.4986 Z, with the signs of the differences.
    development.color_space = ColorSpace::LinearSrgb;
    development.exposure_ev = 0;
    const Image srgb = resolveImage(film, development, kAovColorError);
    CHECK(srgb.pixels[3] == Approx(std::abs(3.2406 * 1 - 0.4986 * 4) / 2).epsilon(1e-3));
    // A film without these channels cannot tell.
    CHECK_THROWS_AS(resolveImage(Film({1, 1, channelsFor(kAovReplicates, 2), kAovReplicates}), development,
                                 kAovColorError),
                    Error);
}
