// Images and skies around a scene: how directions are chosen among their texels, and what is refused.
#include "base/log.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "kernel_test.h"
#include "scene_texts.h"

#include <fstream>
#include <numbers>

using namespace kernel_test;
using crt::Scene;
using crt::test::CapturedLog;
using crt::test::parse;
using crt::test::refused;

namespace {

constexpr double kPi = std::numbers::pi;

/// A room without walls under a sky that is bright on one side and black below.
Scene underSky(int type, int rows) {
    crt::Mesh mesh;
    mesh.positions = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    Scene scene = sceneOf(mesh);
    scene.materials.resize(1);
    scene.materials[0].reflectance = crt::constantSpectrum(1);
    scene.objects[0].material = 0;
    crt::CieSky sky;
    sky.type = type;
    sky.towards_sun = {0.48, 0.6, 0.64};
    sky.rows = rows;
    scene.environment->sky = sky;
    scene.environment->light_sampling = true;
    return scene;
}

}  // namespace

TEST_CASE("directions of an environment image are sampled by its density", "[lights][kernel]") {
    constexpr int kRows = 8;
    const crt::CompiledScene compiled = crt::compileScene(underSky(13, kRows), 0);
    const CrtContext ctx = contextOf(compiled);
    const CrtEnvironmentImage* image = crt_environment_image(&ctx);
    REQUIRE(image->width == 2 * kRows);
    // The density over the sphere is 1, and twice as bright a texel is twice as likely for its solid angle.
    double whole = 0;
    std::vector<double> expected(2 * kRows * kRows);
    constexpr int kSteps = 40;
    for (int i = 0; i < kRows * kSteps; ++i)
        for (int j = 0; j < 2 * kRows * kSteps; ++j) {
            const double theta = (i + 0.5) * kPi / (kRows * kSteps),
                         phi = (j + 0.5) * kPi / (kRows * kSteps);
            const crt::Vec3d d{std::sin(theta) * std::cos(phi), std::cos(theta),
                               std::sin(theta) * std::sin(phi)};
            const CrtEnvironmentPlace place = crt_environment_place(image, toFloat(d));
            const double part =
                crt_environment_density(&ctx, place) * std::sin(theta) * std::pow(kPi / (kRows * kSteps), 2);
            whole += part;
            expected[place.row * 2 * kRows + place.column] += part;
        }
    CHECK(whole == Approx(1).epsilon(1e-3));
    // In a row, density is to radiance as in the next texel.
    const CrtEnvironmentTexel* texels = arrayOf<CrtEnvironmentTexel>(compiled, image->texels);
    for (u32 row = 0; row < kRows / 2; ++row)
        for (u32 column = 0; column < 2 * kRows; ++column) {
            const CrtEnvironmentPlace here{row, column, 0.5f}, first{row, 0, 0.5f};
            CHECK(crt_environment_density(&ctx, here) / crt_environment_density(&ctx, first) ==
                  Approx(texels[row * 2 * kRows + column].scale / texels[row * 2 * kRows].scale)
                      .epsilon(1e-4));
        }
    Random random(9);
    std::vector<std::uint64_t> counts(kRows * kRows);  // the upper half
    int elsewhere = 0;  // by rounding, at edges
    expected.resize(kRows * kRows);
    for (int i = 0; i < 200000; ++i) {
        CrtEnvironmentPlace place{};
        const vec3 d = crt_environment_direction(&ctx, random.pair(), &place);
        const CrtEnvironmentPlace seen = crt_environment_place(image, d);
        elsewhere += seen.row != place.row || seen.column != place.column;
        REQUIRE(place.row < kRows / 2);                                 // below the horizon it is black
        ++counts[place.row * 2 * kRows + place.column];
    }
    CHECK(elsewhere < 40);
    CHECK(std::abs(chiSquaredDeviate(counts, expected)) < 4.4);
}

TEST_CASE("guides of an environment image lead to the item that a whole search finds", "[lights][kernel]") {
    const crt::TemporaryFolder folder;
    // Rows of equal texels, of one bright texel, of none, of few and of many; also a single row.
    const u32 width = GENERATE(2u, 6u, 64u, 514u), height = width / 2;
    CAPTURE(width);
    const std::string path = folder.path() + "/image.pfm";
    Random random(width);
    {
        std::ofstream file(path, std::ios::binary);
        file << "PF\n" << width << " " << height << "\n-1.0\n";
        for (u32 row = 0; row < height; ++row)
            for (u32 column = 0; column < width; ++column) {
                const float y = row % 4 == 0   ? 1.0f
                                : row % 4 == 1 ? (column == width / 3 ? 1e6f : 1e-3f)
                                : row % 4 == 2 ? 0.0f
                                               : static_cast<float>(std::exp2(random.uniform(0, 20)));
                const float rgb[3] = {y, y, y};
                file.write(reinterpret_cast<const char*>(rgb), sizeof rgb);
            }
    }
    const crt::CompiledScene compiled =
        crt::compileScene(parse("environment: {image: " + path + ", light_sampling: true}\n"), 0);
    const CrtContext ctx = contextOf(compiled);
    const CrtEnvironmentImage* image = crt_environment_image(&ctx);
    REQUIRE(image->width == width);
    const auto check = [&](const u32* first, const u32* guide, u32 shift, u32 count) {
        const auto agrees = [&](u32 u) {
            const auto found = static_cast<u32>(std::upper_bound(first, first + count, u) - first) - 1;
            return crt_chosen(first, guide, shift, u) == found;
        };
        int wrong = !agrees(0) + !agrees(~0u);
        for (u32 i = 1; i < count; ++i) wrong += !agrees(first[i] - 1) + !agrees(first[i]);
        for (u32 part = 1; part < 1u << (32 - shift); ++part)
            wrong += !agrees((part << shift) - 1) + !agrees(part << shift);
        CHECK(wrong == 0);
    };
    const u32* guides = CRT_ARRAY(u32, ctx.blob, image->column_guides);
    const u32 guide_size = image->column_guides.count / height;
    CHECK(guide_size == (1u << (32 - image->column_shift)) + 1);
    CHECK(guide_size <= 1 + std::max(2u, width / 16));
    const u32* row_guide = CRT_ARRAY(u32, ctx.blob, image->row_guide);
    check(CRT_ARRAY(u32, ctx.blob, image->rows), row_guide, image->row_shift, height);
    for (u32 row = 0; row < height; ++row)
        check(crt_environment_columns(&ctx, image, row), guides + row * guide_size, image->column_shift,
              width);
}

TEST_CASE("what an environment cannot be is refused at its place", "[lights]") {
    const crt::TemporaryFolder folder;
    const auto pfm = [&](const char* name, int width, int height, const std::vector<float>& values) {
        std::ofstream file(folder.path() + "/" + name, std::ios::binary);
        file << "PF\n" << width << " " << height << "\n-1.0\n";
        file.write(reinterpret_cast<const char*>(values.data()),
                   static_cast<std::streamsize>(values.size() * sizeof(float)));
        return folder.path() + "/" + name;
    };
    const auto said = [](const std::string& environment) -> std::string {
        const CapturedLog quiet;
        try {
            crt::compileScene(parse("environment: {" + environment + "}\n"), 0);
        } catch (const crt::Error& error) {
            CHECK(error.kind() == crt::ErrorKind::Scene);
            return error.what();
        }
        return "accepted";
    };
    CHECK(said("image: " + pfm("good.pfm", 2, 1, {1, 1, 1, 0, 0, 0})) == "accepted");
    CHECK(said("image: " + pfm("black.pfm", 2, 1, std::vector<float>(6))) == "accepted");
    CHECK_THAT(said("image: " + pfm("square.pfm", 2, 2, std::vector<float>(12, 1))),
               Contains("has 2 x 2 pixels") && Contains("scene.yaml:2:"));
    for (const auto& [value, words] : {std::pair{-1.0f, "not negative"},
                                       {std::nanf(""), "light is a number"},
                                       {std::numeric_limits<float>::infinity(), "light is finite"},
                                       {1e30f, "radiance goes up to"}})
        CHECK_THAT(said("image: " + pfm("bad.pfm", 2, 1, {1, 1, 1, 0, value, 0})),
                   Contains("in pixel (1, 0)") && Contains(words) && Contains("scene.yaml:2:"));
    CHECK_THAT(said("image: " + pfm("short.pfm", 20, 10, {1, 1, 1})), Contains("short.pfm"));
    CHECK_THAT(said("image: " + pfm("huge.pfm", 2000000, 1000000, {1, 1, 1})), Contains("huge.pfm"));
    CHECK_THAT(refused("environment: {image: nowhere.exr}\n"), Contains("cannot find 'nowhere.exr'"));
    CHECK_THAT(refused("environment: {}\n"), Contains("needs radiance or image or sky"));
    CHECK_THAT(refused("environment: {radiance: 1, scale: 2}\n"), Contains("exclude each other"));
    CHECK_THAT(refused("environment: {image: " + folder.path() + "/good.pfm, up: [0, 0, 0]}\n"),
               Contains("length 0"));
    const std::string sky = "environment: {sky: {type: 12, zenith_luminance_cd_m2: 1000, ";
    CHECK(parse(sky + "direction: [0, -1, 0]}}\n").environment->light_sampling);
    CHECK_THAT(refused(sky + "direction: [0, 1, 0]}}\n"), Contains("below the horizon"));
    CHECK(parse(sky + "direction: [0, 0, -1], up: [0, 0, 1]}}\n").environment->sky->axes.up[2] == 1);
    CHECK_THAT(refused(sky + "direction: [0, -1, 0], up: [0, 0, 1]}}\n"), Contains("below the horizon"));
    CHECK_THAT(refused(sky + "direction: [0, -1, 0], rows: 33}}\n"), Contains("even"));
    CHECK_THAT(refused("environment: {sky: {type: 16, zenith_luminance_cd_m2: 1, direction: [0, -1, 0]}}\n"),
               Contains("must be 1 to 15"));
    CHECK_THAT(refused("environment: {sky: {type: 1, direction: [0, -1, 0]}}\n"),
               Contains("needs zenith_luminance_cd_m2 or horizontal_illuminance_lx"));
}
