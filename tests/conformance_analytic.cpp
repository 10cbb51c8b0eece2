// Scenes whose answer is known in closed form, or from deterministic quadrature.
#include "conformance.h"

#include "error_estimate.h"
#include "stats/statistics.h"

#include <fmt/format.h>

#include <cmath>

using namespace conformance;

namespace {

/// A unit cube seen from inside: each face a quad facing inwards; the faces in `emitting` have radiance 1, all have the reflectance.
std::string unitCube(double reflectance, const std::string& emitting, const std::string& camera, int max_depth, bool nee) {
    std::string yaml = fmt::format(R"(crt: 1
camera: {}
film: {{resolution: [16, 16]}}
integrator: {{type: path, max_depth: {}, roulette: false, nee: {}}}
materials: {{wall: {{type: diffuse, reflectance: {}}}}}
objects:
)",
                                   camera, max_depth, nee, reflectance);
    const std::pair<const char*, const char*> faces[] = {
        {"floor", "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]"},   {"ceiling", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]"},
        {"left", "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]"},    {"right", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]"},
        {"back", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]"},    {"front", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]"},
    };
    for (const auto& [name, positions] : faces) {
        const bool emits = emitting == "all" || emitting == name;
        yaml += fmt::format("  - {{name: {}, mesh: {{positions: {}, faces: [[0,1,2,3]]}}, material: wall{}}}\n", name, positions,
                            emits ? ", emission: {radiance: 1}" : "");
    }
    return yaml;
}

constexpr const char* kAnywhere = "{position: [0.3, 0.4, 0.2], target: [0.6, 0.5, 0.9], fov: 80}";

/// A square light of side 1 at height 1 over a Lambertian floor of reflectance 1, seen at (x, 0, 0) through a needle's eye.
std::string squareOverFloor(double x) {
    return fmt::format(R"(crt: 1
camera: {{position: [{0}, 0.5, 3], target: [{0}, 0, 0], fov: 0.01}}
film: {{resolution: [16, 16]}}
integrator: {{type: path, max_depth: 1}}
materials: {{floor: {{type: diffuse, reflectance: 1}}, lamp: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{name: floor, mesh: {{positions: [[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]], faces: [[0,1,2,3]]}}, material: floor}}
  - {{name: lamp, mesh: {{positions: [[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]], faces: [[0,1,2,3]]}}, material: lamp, emission: {{radiance: 1}}}}
)",
                       x);
}

}  // namespace

TEST_CASE("white furnace: E (1 - rho^(k+1)) / (1 - rho), pixel by pixel, without light sampling", "[analytic]") {
    // Every path brings the same radiance whatever its directions and wavelengths, so the image at depth k is the image at depth 0, which is
    // the emitted radiance alone, times the closed form: no statistics, only rounding. 2e-6 is 16 roundings of a sum of up to 65 terms.
    for (const double rho : {0.5, 0.8}) {
        Run run;
        run.samples = 4;
        const crt::Film emitted = render(backend(), sceneFrom(unitCube(rho, "all", kAnywhere, 0, false)), run);
        for (const int k : {1, 2, 8, 64}) {
            const crt::Film film = render(backend(), sceneFrom(unitCube(rho, "all", kAnywhere, k, false)), run);
            const double expected = (1 - std::pow(rho, k + 1)) / (1 - rho);
            double worst = 0;
            for (std::uint32_t y = 0; y < 16; ++y)
                for (std::uint32_t x = 0; x < 16; ++x)
                    worst = std::max(worst, std::abs(film.mean(x, y, 1) / emitted.mean(x, y, 1) / expected - 1));
            INFO("rho " << rho << ", k " << k);
            CHECK(worst < 2e-6);
        }
    }
}

TEST_CASE("white furnace with light sampling and MIS: 99.9 % interval within 0.3 %", "[analytic]") {
    requireMean(unitCube(0.5, "all", kAnywhere, 8, true), (1 - std::pow(0.5, 9)) / 0.5, 0.003, 64);
}

TEST_CASE("square light over a floor: rho times the form factor, 99.9 % interval within 0.3 %", "[analytic]") {
    // Form factors of a unit square at height 1 from a point at offset x, by the rectangle formula and by Lambert's polygon formula, equal
    // to 12 digits.
    requireMean(squareOverFloor(0), 0.2394564705, 0.003, 256);
    requireMean(squareOverFloor(1), 0.0843536644, 0.003, 256);
    requireMean(squareOverFloor(2), 0.0139237174, 0.003, 256);
}

TEST_CASE("the error that an image states of itself is its error: 60 seeds of the square light, Sobol and independent", "[analytic][error]") {
    constexpr double kTruth = 0.2394564705;
    constexpr int kSeeds = 60;
    const char* sampler = GENERATE("sobol", "independent");
    Run run;
    run.samples = 1024;
    int covered = 0;
    double claimed = 0, squares = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
        const crt::Scene scene = sceneFrom(squareOverFloor(0), {{"film.resolution", "[1,1]"}, {"sampler.type", sampler}, {"sampler.seed", std::to_string(seed)}});
        run.aovs = crt::kAovReplicates;
        const std::optional<crt::ErrorEstimate> error = crt::estimateError(render(backend(), scene, run));
        REQUIRE(error);
        covered += error->meanInterval(0.95).contains(kTruth);
        claimed += error->mean_standard_error * error->mean_standard_error / kSeeds;
        squares += (error->mean_luminance - kTruth) * (error->mean_luminance - kTruth) / kSeeds;
    }
    INFO(sampler << ": " << covered << " of " << kSeeds << " intervals hold the truth, predicted : actual error " << std::sqrt(claimed / squares));
    CHECK(covered >= 49);  // Of 60 with probability 0.95 each, 48 or fewer turn up in one of 27,000 runs.
    // The mean square of 60 errors over that of what 60 images with 15 degrees of freedom each claim, 99.99 % band.
    CHECK(squares / claimed > crt::stats::fisherQuantile(0.00005, kSeeds, 15.0 * kSeeds));
    CHECK(squares / claimed < crt::stats::fisherQuantile(0.99995, kSeeds, 15.0 * kSeeds));
}

TEST_CASE("unit cube with a glowing ceiling: every depth by deterministic quadrature, 99.9 % interval within 0.3 %", "[analytic]") {
    // Nyström solution of the radiosity equation, rho = .5, E = 1, six discretisations agreeing to 1e-6.
    struct Probe {
        const char* camera;
        int depth;
        double expected;
    };
    constexpr const char* floor_centre = "{position: [0.5, 0.5, 0.1], target: [0.5, 0, 0.5], fov: 0.01}";
    constexpr const char* floor_quarter = "{position: [0.5, 0.5, 0.5], target: [0.25, 0, 0.25], fov: 0.01}";
    constexpr const char* wall_centre = "{position: [0.5, 0.4, 0.2], target: [0, 0.5, 0.5], fov: 0.01}";
    constexpr const char* ceiling_centre = "{position: [0.4, 0.2, 0.2], target: [0.5, 1, 0.5], fov: 0.01}";
    for (const Probe& p : {
             Probe{floor_centre, 1, .1197282},
             {floor_centre, 2, .1544164},
             {floor_centre, 3, .176954},
             {floor_centre, 10, .197441},
             {floor_quarter, 3, .157127},
             {wall_centre, 2, .1358782},
             {wall_centre, 10, .177485},
             {ceiling_centre, 2, 1.052071},
         }) {
        INFO(p.camera << ", depth " << p.depth);
        requireMean(unitCube(0.5, "ceiling", p.camera, p.depth, true), p.expected, 0.003, 256);
    }
}

TEST_CASE("the same cube without light sampling, and with roulette", "[analytic]") {
    constexpr const char* camera = "{position: [0.5, 0.5, 0.1], target: [0.5, 0, 0.5], fov: 0.01}";
    requireMean(unitCube(0.5, "ceiling", camera, 5, false), .192400, 0.003, 1024);
    std::string with_roulette = unitCube(0.5, "ceiling", camera, 64, true);
    with_roulette.replace(with_roulette.find("roulette: false"), 15, "roulette_depth: 1");
    requireMean(with_roulette, .197603, 0.003, 512);
}

TEST_CASE("a clear dielectric cube in a constant environment vanishes", "[analytic]") {
    const auto scene = [](double ior, int max_depth) {
        return fmt::format(R"(crt: 1
camera: {{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 15}}
film: {{resolution: [16, 16]}}
integrator: {{type: path, max_depth: {}, roulette: false}}
environment: {{radiance: 1}}
materials: {{glass: {{type: dielectric, ior: {}}}}}
objects:
  - {{name: cube, material: glass, mesh: {{positions: [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]],
      faces: [[0,3,2,1],[4,5,6,7],[0,1,5,4],[2,3,7,6],[0,4,7,3],[1,2,6,5]]}}}}
)",
                           max_depth, ior);
    };
    // At depth 0 the cube is a black silhouette; the environment alone is the expectation everywhere. Entering and leaving scale by 1/n² and n².
    Run run;
    run.samples = 64;
    const std::string empty = "crt: 1\ncamera: {position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 15}\nfilm: {resolution: [16, 16]}\nenvironment: {radiance: 1}\n";
    const crt::Film background = render(backend(), sceneFrom(empty), run);
    const crt::Film film = render(backend(), sceneFrom(scene(1.5, 128)), run);
    CHECK(std::abs(imageMean(film) / imageMean(background) - 1) < 5e-4);
    // An index of exactly 1 is no surface at all.
    CHECK(differingPixels(render(backend(), sceneFrom(scene(1.0, 8)), run), background, false) == 0);
    // The silhouette is there to be seen through.
    CHECK(imageMean(render(backend(), sceneFrom(scene(1.5, 0)), run)) < 0.7 * imageMean(background));
}

TEST_CASE("a mirror adds the image of the light to the floor", "[analytic]") {
    // A05: perfect mirror wall at x = 2, receiver at the origin: F(0) + F(image) = .2394564705 + .001141273786. Only BSDF sampling finds the image.
    std::string yaml = squareOverFloor(0);
    yaml.replace(yaml.find("max_depth: 1"), 12, "max_depth: 2");
    yaml.replace(yaml.find("materials: {"), 12, "materials: {mirror: {type: mirror, reflectance: 1}, ");
    yaml += "  - {name: mirror, mesh: {positions: [[2,0,-40],[2,0,40],[2,80,40],[2,80,-40]], faces: [[0,1,2,3]]}, material: mirror}\n";
    requireMean(yaml, .2405977442, 0.003, 1024);
}
