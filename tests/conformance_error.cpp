// The error that an image states, against a scene with a known result.
#include "conformance.h"

#include "base/statistics.h"
#include "film/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <optional>

using namespace conformance;

namespace {

/// configs/analytic/direct_light.yaml, where the closed form is.
constexpr const char* kSquareOverFloor = R"(crt: 1
camera: {position: [0, 0.5, 3], target: [0, 0, 0], fov: 0.01}
film: {resolution: [1, 1]}
integrator: {type: path, max_depth: 1}
materials: {floor: {type: diffuse, reflectance: 1}, lamp: {type: diffuse, reflectance: 0}}
objects:
  - {name: floor, mesh: {positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], faces: [[0,1,2,3]]},
      material: floor}
  - {name: lamp, mesh: {positions: [[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]],
      faces: [[0,1,2,3]]}, material: lamp, emission: {radiance: 1}}
)";

}  // namespace

TEST_CASE(
    "the error that an image states of itself is its error: "
    "60 seeds of the square light, Sobol and independent",
    "[error]") {
    constexpr double kTruth = 0.2394564705;
    constexpr int kSeeds = 60;
    const char* sampler = GENERATE("sobol", "independent");
    Run run;
    run.samples = 1024;
    run.aovs = crt::kAovReplicates;
    int covered = 0;
    double claimed = 0, squares = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
        const crt::Scene scene =
            sceneFrom(kSquareOverFloor, {{"sampler.type", sampler}, {"sampler.seed", std::to_string(seed)}});
        const std::optional<crt::ErrorEstimate> error = crt::estimateError(render(backend(), scene, run));
        REQUIRE(error);
        covered += error->meanInterval(0.95).contains(kTruth);
        claimed += error->mean_standard_error * error->mean_standard_error / kSeeds;
        squares += (error->mean_luminance - kTruth) * (error->mean_luminance - kTruth) / kSeeds;
    }
    INFO(sampler << ": " << covered << " of " << kSeeds
                 << " intervals hold the truth, predicted : actual error " << std::sqrt(claimed / squares));
    CHECK(covered >= 49);  // Of 60 with probability 0.95 each, 48 or fewer turn up in one of 27,000 runs.
    // The mean square of 60 errors over that of what 60 images with 15 degrees of freedom each claim, 99.99
    // % band.
    CHECK(squares / claimed > crt::stats::fisherQuantile(0.00005, kSeeds, 15.0 * kSeeds));
    CHECK(squares / claimed < crt::stats::fisherQuantile(0.99995, kSeeds, 15.0 * kSeeds));
}

TEST_CASE("a film's replicates of X, Y and Z are the sums of their own samples", "[error]") {
    Run run;
    run.samples = 32;
    run.aovs = crt::kAovColorError;
    const crt::Scene scene =
        sceneFrom(kSquareOverFloor, {{"sampler.type", "sobol"}, {"sampler.replicates", "4"}});
    const crt::Film whole = render(backend(), scene, run);
    REQUIRE(whole.replicates() == 4);
    double largest = 0;
    for (std::uint32_t replicate = 0; replicate < 4; ++replicate) {
        std::optional<crt::Film> own;  // Replicates take turns.
        for (std::uint32_t sample = replicate; sample < 32; sample += 4) {
            Run one = run;
            one.first_sample = sample;
            one.samples = 1;
            const crt::Film part = render(backend(), scene, one);
            if (own) own->add(part);
            else own = part;
        }
        for (std::uint32_t c = 0; c < 3; ++c) {
            CAPTURE(replicate, c);
            const double sum = whole.replicateSumOf(c, 0, 0, replicate);
            CHECK(sum == Approx(own->sum(0, 0, c)).epsilon(1e-13));
            largest = std::max(largest, std::abs(sum / whole.sum(0, 0, c) - 0.25));
        }
    }
    CHECK(largest > 1e-6);  // They differ, or any order of them would pass.
}
