// Group I, the part about samples that add to other pixels than their own (kernel/film/splat.h). The test
// integrator throws each sample onto a random pixel, and its image is a ramp.
#include "film/error_estimate.h"
#include "verify/context.h"
#include "verify/scenes.h"
#include "verify/variants.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt::verify {
namespace {

constexpr const char* kSamplers[] = {"independent", "xorshift", "sobol"};

/// A lamp of this radiance, whose power is about 8 times it, and the test integrator.
std::string thrown(const std::string& film, const std::string& sampler, const std::string& radiance = "1") {
    return Stage("{position: [0, 0, 0], target: [0, 0, 1], fov: 40}", "{type: splat_test, max_depth: 0}")
        .set("film", fmt::format("{{{}}}", film))
        .set("sampler", fmt::format("{{{}}}", sampler))
        .material("it", "{type: diffuse, reflectance: 0.5}")
        .quad("lamp", "[[-1,-1,1],[-1,1,1],[1,1,1],[1,-1,1]]", "it", radiance)
        .yaml();
}

/// Mean of Z: 1 where no splat is lost.
double meanZ(const Film& film) {
    double sum = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) sum += film.mean(x, y, 2);
    return sum / static_cast<double>(film.counts.size());
}

/// The largest deviation of a pixel from the ramp of a film of this size, in standard deviations of the
/// number of splats; the window begins at (x0, y0).
double largestDeviation(const Film& film, std::uint32_t width, std::uint32_t height, std::uint32_t x0,
                        std::uint32_t y0) {
    double largest = 0;
    // A pixel gets on average one of the samples that have one number, whatever the window.
    const double share = static_cast<double>(film.counts.size()) / (double{1} * width * height);
    const double sigma = 1 / std::sqrt(static_cast<double>(film.samples.count()) * share);
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) {
            const double ramp[] = {(x0 + x + 1.0) / width, (y0 + y + 1.0) / height, 1};
            for (std::uint32_t c = 0; c < 3; ++c)
                largest = std::max(largest, std::abs(film.mean(x, y, c) / ramp[c] - 1) / sigma);
        }
    return largest;
}

void splats(Context& context) {
    for (const char* sampler : kSamplers) {
        const Film film = context.render(
            thrown("resolution: [32, 16]", fmt::format("type: {}", sampler)), samples(256));
        context.relative(fmt::format("{}: all splats together", sampler), meanZ(film), 1, 1e-9);
        // 512 pixels of three channels, of which the deviations are the same.
        context.absolute(fmt::format("{}: a pixel's deviation from the ramp, in σ", sampler),
                         largestDeviation(film, 32, 16, 0, 0), 2.5, 2.5);
        const Film window = context.render(
            thrown("resolution: [32, 16], crop: [5, 3, 21, 11]", fmt::format("type: {}", sampler)),
            samples(256));
        context.absolute(fmt::format("{}: the same in a crop window", sampler),
                         largestDeviation(window, 32, 16, 5, 3), 2.5, 2.5);
    }
    const Film film =
        context.render(thrown("resolution: [32, 16]", "type: independent, replicates: 1"), samples(64));
    context.relative("without replicates: all splats together", meanZ(film), 1, 1e-9);
    // A lamp so dim that 32 splats pass 2^64 units.
    const Film dim = context.render(
        thrown("resolution: [2, 2]", "type: independent", "1e-9"), samples(256));
    context.relative("sums of more than 64 bits", meanZ(dim), 1, 1e-9,
                     {{0.5, "the carry into the high word is lost"}});
}

void splatsThatDoNotFit(Context& context) {
    const Film film = context.render(
        thrown("resolution: [4, 4]", "type: independent", "1e-14"), samples(16));
    context.relative("splats that are left out and counted", static_cast<double>(film.droppedSplats()),
                     4 * 4 * 16, 0);
    context.relative("what the image has of them", meanZ(film), 0, 0);
}

void splatBits(Context& context) {
    for (const char* sampler : kSamplers) {
        const Scene scene =
            context.scene(thrown("resolution: [37, 19]", fmt::format("type: {}, replicates: 4", sampler)));
        const Film whole = context.render(scene, samples(24));
        context.sameBits(fmt::format("{}: crt's own build of the kernel, on one thread", sampler), whole,
                         portableFilm(scene, samples(24)), "backends add other things to other pixels");
        Film parts = context.render(scene, {.samples = 7, .first_sample = 17});
        parts.add(context.render(scene, {.samples = 5}));
        parts.add(context.render(scene, {.samples = 12, .first_sample = 5}));
        context.sameBits(fmt::format("{}: three ranges of samples, merged", sampler), whole, parts,
                         "sums depend on their order, or splats on the range");
        for (const unsigned threads : {1u, 7u})
            context.sameBits(fmt::format("{}: {} threads", sampler, threads), whole,
                             context.render(scene, {.samples = 24, .threads = threads, .tile_size = 5}),
                             "two threads that add to one pixel at the same time lose a splat");
        context.sameBits(fmt::format("{}: the kernel with everything in it", sampler), whole,
                         context.render(scene, {.samples = 24, .kernel = CRT_KERNEL_FULL}),
                         "the lean kernel leaves something out");
    }
}

void splatErrors(Context& context) {
    for (const char* sampler : kSamplers) {
        // The squared error that films really have, over the one that they expect.
        constexpr int kSeeds = 24;
        double squared = 0, expected = 0;
        int covered = 0;
        for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
            const Film film = context.render(
                thrown("resolution: [32, 16]", fmt::format("type: {}, replicates: 4", sampler)),
                {.samples = 64, .seed = seed});
            double sum = 0;
            for (std::uint32_t y = 0; y < 16; ++y)
                for (std::uint32_t x = 0; x < 32; ++x)
                    sum += std::pow(film.mean(x, y, 1) - (y + 1) / 16.0, 2) / 512;
            const std::optional<ErrorEstimate> error = estimateError(film);
            if (!error) continue;
            const double mean = 17.0 / 32;
            squared += sum / (mean * mean);
            expected += error->relative_rmse * error->relative_rmse;
            covered += std::sqrt(sum) / mean <= error->half_width_95 ? 1 : 0;
        }
        context.relative(fmt::format("{}: squared error over the expected one", sampler), squared / expected,
                         1, 0.05, {{0, "films with splats state no error"}});
        context.absolute(fmt::format("{}: share of errors within their bound", sampler),
                         covered / double{kSeeds}, 0.9, 0.1);
    }
    const Film film = context.render(
        thrown("resolution: [32, 16]", "type: independent, replicates: 1"), samples(64));
    context.holds("without replicates no error is stated", !estimateError(film), "no error",
                  "squares of a pixel's own samples are taken for the scatter of its splats");
}

}  // namespace

std::vector<Case> splatCases() {
    return {
        row("I15", "splats",
            "Samples thrown onto random pixels, in films, crop windows and sums of 65 bits", "a ramp",
            "probability of a pixel", "5 σ; all together 1e-9", Level::Commit, CRT_FEATURE_SPLAT, splats),
        row("I16", "large-splats", "Splats above 2^31 times the power of the scene", "left out and counted",
            "–", "exactly", Level::Commit, CRT_FEATURE_SPLAT, splatsThatDoNotFit),
        row("I17", "splat-bits", "Splats by threads, tiles, ranges of samples and kernels", "one image",
            "–", "same bits", Level::Commit, CRT_FEATURE_SPLAT, splatBits),
        row("I18", "splat-errors", "The error that films with splats state", "the one that they have",
            "the ramp", "5 % of its square", Level::Commit, CRT_FEATURE_SPLAT, splatErrors),
    };
}

}  // namespace crt::verify
