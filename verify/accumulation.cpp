// Group I: sums of many samples, random numbers, samplers.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"
#include "kernel/sampling/sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace crt::verify {
namespace {

constexpr std::uint64_t kDirectLight = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE;
constexpr const char* kSamplers[] = {"sobol", "independent", "xorshift"};
constexpr std::uint32_t kKinds[] = {CRT_SAMPLER_SOBOL, CRT_SAMPLER_INDEPENDENT, CRT_SAMPLER_XORSHIFT};

std::string noisy(const char* sampler, const char* film = "{resolution: [4, 4]}") {
    std::string text = squareOverFloor(0, kDirect) + fmt::format("sampler: {{type: {}}}\n", sampler);
    text.replace(text.find("{resolution: [4, 4]}"), 20, film);
    return text;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const stats::Summary sa = stats::summarize(a), sb = stats::summarize(b);
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - sa.mean) * (b[i] - sb.mean);
    return sum / (static_cast<double>(a.size()) - 1) / std::sqrt(sa.variance * sb.variance);
}

/// Y of every pixel.
std::vector<double> values(const Film& film) {
    std::vector<double> v;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) v.push_back(film.mean(x, y, 1));
    return v;
}

void constantPixel(Context& context) {
    // The view of shading normals gives every sample the same value.
    std::string text = Stage("{position: [0, 0, 0], target: [0, 0, 1], fov: 1}", "{type: normals}")
                           .set("film", "{resolution: [1, 1]}")
                           .material("it", "{type: diffuse, reflectance: 0.5}")
                           .quad("it", "[[-1,-1,1],[-1,1,1],[1,1,1],[1,-1,1]]", "it")
                           .yaml();
    const Film one = context.render(text, {.samples = 1});
    for (const int bits : {10, 20, 24, 25, 27}) {
        if (bits > 20 && !context.atLeast(Level::Merge)) continue;
        if (bits > 25 && !context.atLeast(Level::Nightly)) continue;
        const Film film = context.render(text, {.samples = std::uint64_t{1} << bits});
        context.relative(fmt::format("2^{} samples", bits), film.mean(0, 0, 1), one.mean(0, 0, 1), 1e-6,
                         {{one.mean(0, 0, 1) * std::ldexp(1.0, 24 - bits),
                           "the sum stands still from 2^24 on: is it kept in single precision?"}});
        context.relative(fmt::format("2^{} samples: their number", bits),
                         static_cast<double>(film.counts[0]), std::ldexp(1.0, bits), 0);
    }
}

void noisyPixel(Context& context) {
    const double expected = squareFormFactor(0, 0.5);
    // Independent numbers; the spread of a path, wavelengths and all, is measured on the way.
    const Film few =
        context.render(noisy("independent", "{resolution: [1, 1]}"), {.samples = 65536, .squares = true});
    const double spread = std::sqrt(pathVariance(few, 0, 0)) / expected;
    for (const int bits : {20, 24, 27}) {
        if (bits > 20 && !context.atLeast(Level::Merge)) continue;
        if (bits > 24 && !context.atLeast(Level::Nightly)) continue;
        const Film film = context.render(noisy("independent", "{resolution: [1, 1]}"),
                                         {.samples = std::uint64_t{1} << bits});
        context.relative(fmt::format("2^{} samples", bits), film.mean(0, 0, 1), expected,
                         4 * spread / std::sqrt(std::ldexp(1.0, bits)) + 1e-6);
    }
}

void highIndices(Context& context) {
    const double expected = squareFormFactor(0, 0.5);
    const Scene scene = context.scene(noisy("sobol"));
    const Film low = context.render(scene, {.samples = 4096});
    for (const char* sampler : kSamplers) {
        const Scene with = context.scene(noisy(sampler));
        for (const int bits : {31, 32, 40, 52}) {
            const Film film =
                context.render(with, {.samples = 4096, .first_sample = (std::uint64_t{1} << bits) - 2048});
            context.relative(fmt::format("{}: 4096 samples around number 2^{}", sampler, bits),
                             radiance(film), expected, 0.02);
        }
    }
    const Film high = context.render(scene, {.samples = 4096, .first_sample = std::uint64_t{1} << 32});
    context.holds("samples from 2^32 on are not those from 0 on", values(low) != values(high), "different",
                  "the number of a sample is cut to 32 bits: samples repeat");
    Film sum = low;
    sum.add(high);
    context.relative("merged: number of samples", static_cast<double>(sum.samples.count()), 8192, 0);
}

void merging(Context& context) {
    for (const char* sampler : kSamplers) {
        const Scene scene = context.scene(noisy(sampler, "{resolution: [8, 8]}"));
        const Film whole = context.render(scene, {.samples = 64});
        Film halves = context.render(scene, {.samples = 32, .first_sample = 32});
        halves.add(context.render(scene, {.samples = 32}));
        context.sameBits(fmt::format("{}: [32, 64) and then [0, 32) against [0, 64)", sampler), whole,
                         halves, "samples depend on what was rendered before, or sums on their order");
        Film thirds = context.render(scene, {.samples = 21});
        thirds.add(context.render(scene, {.samples = 1, .first_sample = 21}));
        thirds.add(context.render(scene, {.samples = 42, .first_sample = 22}));
        context.sameBits(fmt::format("{}: three uneven parts", sampler), whole, thirds,
                         "samples depend on what was rendered before, or sums on their order");
    }
}

void threadsAndTiles(Context& context) {
    const Scene scene = context.scene(noisy("sobol", "{resolution: [37, 19]}"));
    const Film all = context.render(scene, {.samples = 8});
    for (const unsigned threads : {1u, 2u, 7u, 64u})
        context.sameBits(fmt::format("{} thread{}", threads, threads == 1 ? "" : "s"), all,
                         context.render(scene, {.samples = 8, .threads = threads}),
                         "the schedule shows in the image: a race, or a shared state");
    for (const unsigned tile : {1u, 8u, 13u, 128u})
        context.sameBits(fmt::format("tiles of {}", tile), all,
                         context.render(scene, {.samples = 8, .tile_size = tile}),
                         "the schedule shows in the image: a race, or a shared state");
}

void seeds(Context& context) {
    for (const char* sampler : kSamplers) {
        std::set<std::vector<double>> images;
        for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 32,
                                         std::numeric_limits<std::uint64_t>::max() >> 1}) {
            const Film film = context.render(noisy(sampler), {.samples = 1024, .seed = seed});
            context.relative(fmt::format("{}, seed {}", sampler, seed), radiance(film),
                             squareFormFactor(0, 0.5), 0.02);
            images.insert(values(film));
        }
        context.relative(fmt::format("{}: different images among four seeds", sampler),
                         static_cast<double>(images.size()), 4, 0,
                         {{3, "seeds that differ by 2^32 are one: is the seed cut to 32 bits?"}});
    }
}

void neighbours(Context& context) {
    constexpr std::uint32_t n = 96;
    for (const char* sampler : kSamplers) {
        const Film film = context.render(noisy(sampler, "{resolution: [96, 96]}"), {.samples = 1});
        std::vector<double> here, right, below;
        for (std::uint32_t y = 0; y + 1 < n; ++y)
            for (std::uint32_t x = 0; x + 1 < n; ++x) {
                here.push_back(film.mean(x, y, 1));
                right.push_back(film.mean(x + 1, y, 1));
                below.push_back(film.mean(x, y + 1, 1));
            }
        const double limit = 4 / std::sqrt(static_cast<double>(here.size()));
        const char* physics =
            "neighbouring pixels have the same noise: is the pixel left out of the random numbers?";
        context.absolute(fmt::format("{}: correlation with the pixel to the right", sampler),
                         correlation(here, right), 0, limit, {{1, physics}});
        context.absolute(fmt::format("{}: correlation with the pixel below", sampler),
                         correlation(here, below), 0, limit, {{1, physics}});
    }
}

void streams(Context& context) {
    // Seeds, samples and dimensions are hashed together; there is no stream that another runs into.
    // Neighbouring seeds are the ones that could.
    for (const char* sampler : kSamplers) {
        const auto image = [&](std::uint64_t seed) {
            return values(
                context.render(noisy(sampler, "{resolution: [96, 96]}"), {.samples = 1, .seed = seed}));
        };
        const std::vector<double> zero = image(0);
        for (const std::uint64_t seed : {1, 2, 1024})
            context.absolute(fmt::format("{}: correlation of seeds 0 and {}", sampler, seed),
                             correlation(zero, image(seed)), 0, 4 / 96.0, {{1, "two seeds are one stream"}});
    }
}

void draws(Context& context) {
    // The numbers themselves (the kernel's source compiled as C++; equal bits carry the result over to every
    // backend).
    using namespace kernel;
    constexpr std::uint32_t count = 1u << 17;
    std::vector<double> p_values;
    double worst_correlation = 0;
    for (const std::uint32_t kind : kKinds) {
        // xorshift gives numbers in the order in which they are asked for; so they are.
        constexpr std::uint32_t dimensions = 6;
        std::vector<std::vector<double>> u(dimensions);
        for (std::uint32_t i = 0; i < count; ++i) {
            CrtSampler s = crt_sampler_begin(kind, 0, crt_seed(7, 0), i, 3);
            for (std::uint32_t d = 0; d < dimensions; ++d) u[d].push_back(crt_sample_1d(&s, d));
        }
        for (std::uint32_t d = 0; d < dimensions; ++d) {
            p_values.push_back(stats::kolmogorovSmirnovUniform(u[d]));
            for (std::uint32_t e = 0; e < d; ++e)
                worst_correlation = fartherFrom(0, worst_correlation, std::abs(correlation(u[d], u[e])));
        }
    }
    const double least = *std::min_element(p_values.begin(), p_values.end());
    context.holds("uniform over pixels: least p of Kolmogorov and Smirnov",
                  least > stats::sidak(1e-4, p_values.size()),
                  fmt::format("> {:.2g}", stats::sidak(1e-4, p_values.size())),
                  "numbers of neighbouring pixels are not uniform",
                  fmt::format("{:.3g} of {} tests", least, p_values.size()));
    context.absolute("largest correlation of two dimensions", worst_correlation, 0,
                     4.5 / std::sqrt(static_cast<double>(count)),
                     {{1, "two dimensions have the same numbers"}});
}

void residuals(Context& context) {
    for (const char* sampler : kSamplers) {
        const auto image = [&](std::uint64_t seed, std::uint64_t first) {
            return values(context.render(noisy(sampler, "{resolution: [64, 64]}"),
                                         {.samples = 16, .first_sample = first, .seed = seed}));
        };
        const std::vector<double> a = image(1, 0);
        context.absolute(fmt::format("{}: two seeds", sampler), correlation(a, image(2, 0)), 0, 4 / 64.0,
                         {{1, "two seeds are one"}});
        // Later points of a stratified sequence fill what the earlier ones left: their errors may be
        // opposite, never alike.
        const double r = correlation(a, image(1, 16));
        context.holds(fmt::format("{}: two ranges of samples", sampler),
                      std::string(sampler) == "sobol" ? r < 4 / 64.0 : std::abs(r) < 4 / 64.0,
                      "|r| < 4/64; for sobol r < 4/64", "samples repeat", fmt::format("r = {:.3g}", r));
    }
}

void sobol(Context& context) {
    using namespace kernel;
    // Of every 2^m consecutive points each elementary interval of area 2^-m holds exactly one.
    std::uint64_t wrong = 0, asked = 0;
    for (const std::uint64_t first :
         {std::uint64_t{0}, std::uint64_t{1} << 20, (std::uint64_t{1} << 32) + (1u << 12)})
        for (const std::uint32_t dimension : {0u, 5u, 4001u})
            for (int m = 1; m <= 8; ++m)
                for (int k = 0; k <= m; ++k) {
                    std::vector<int> count(std::size_t{1} << m);
                    for (std::uint64_t i = 0; i < (1u << m); ++i) {
                        CrtSampler s =
                            crt_sampler_begin(CRT_SAMPLER_SOBOL, 0, crt_seed(1, 2), 77, first + i);
                        const CrtRandom2 u = crt_sample_2d(&s, dimension);
                        const auto x = static_cast<std::size_t>(std::ldexp(u.x, k)),
                                   y = static_cast<std::size_t>(std::ldexp(u.y, m - k));
                        ++count[(x << (m - k)) + y];
                    }
                    wrong += static_cast<std::uint64_t>(
                        std::count_if(count.begin(), count.end(), [](int c) { return c != 1; }));
                    ++asked;
                }
    context.relative("elementary intervals without exactly one point", static_cast<double>(wrong), 0, 0,
                     {{static_cast<double>(wrong),
                       "the points are not a (0, 2)-sequence: their scrambling breaks strata"}});
    // Prefixes that are no power of two are unbiased all the same.
    for (const std::uint64_t samples : {3, 100, 1000})
        context.estimate(fmt::format("{} samples", samples), noisy("sobol"), meanRadiance,
                         squareFormFactor(0, 0.5), 0.01,
                         {.samples = samples, .most = samples, .seeds = samples < 10 ? 2048 : 128});
}

void coverage(Context& context) {
    // 400 pixels of A03, each from 16 scrambles: the 95 % interval of a pixel covers the truth in 90 to 98 %
    // of them.
    for (const char* sampler : kSamplers) {
        std::vector<std::vector<double>> replicates(400);
        for (std::uint64_t seed = 1; seed <= 16; ++seed) {
            const Film film =
                context.render(noisy(sampler, "{resolution: [20, 20]}"), {.samples = 64, .seed = seed});
            for (std::uint32_t i = 0; i < 400; ++i) replicates[i].push_back(radiance(film, i % 20, i / 20));
        }
        int covered = 0;
        for (const std::vector<double>& r : replicates)
            covered +=
                stats::meanInterval(stats::summarize(r), 0.95).contains(squareFormFactor(0, 0.5)) ? 1 : 0;
        context.absolute(fmt::format("{}: share of intervals that cover the truth", sampler),
                         covered / 400.0, 0.94, 0.04, {});
    }
}

void infiniteSamples(Context& context) {
    // Radiance near the end of single precision: weights carry some samples to infinity. They are dropped
    // and counted; what remains is finite. Scene files are refused such a lamp (scene_limits.h).
    Scene scene = context.scene(squareOverFloor(0, kDirect, 0.5, "1"));
    for (Emission& emission : scene.emissions) emission.radiance = constantSpectrum(1e37);
    const Film film = context.renderRaw(scene, {.samples = 256});
    const double total = static_cast<double>(film.counts.size()) * 256;
    const auto dropped = static_cast<double>(film.invalidSamples());
    bool finite = true;
    for (const double v : values(film)) finite = finite && std::isfinite(v);
    context.holds("samples that are infinite are counted", dropped > 0 && dropped < total, "some of them",
                  "samples that are no numbers vanish without a trace",
                  fmt::format("{:.0f} of {:.0f} samples", dropped, total));
    context.holds("the image is finite", finite, "finite", "infinite samples are added to the film");
}

/// Glass that reflects one path in 2^17 at normal incidence, of index (1 + √R)/(1 − √R), under a lamp
/// behind the eye; black below.
std::string rareReflection(double radiance) {
    const double r = std::sqrt(std::ldexp(1.0, -17));
    return Stage("{position: [0, 0, 1], target: [0, 0, 0], fov: 0.0001}", kDirect)
        .set("film", "{resolution: [2, 2]}")
        .material("glass", fmt::format("{{type: dielectric, ior: {:.17g}}}", (1 + r) / (1 - r)))
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("interface", "[[-1,-1,0],[1,-1,0],[1,1,0],[-1,1,0]]", "glass")
        .quad("lamp", "[[-1,-1,2],[-1,1,2],[1,1,2],[1,-1,2]]", "black", fmt::format("{:.17g}", radiance))
        .yaml();
}

void noClamping(Context& context) {
    // One path in 2^17 brings 2^17: nothing may cut it down. One stratified number decides which, so that of
    // 2^18 samples it is two; to know the share of chance hits on a small lamp as well would take 1e10.
    const std::uint64_t samples = std::uint64_t{1} << 18;
    context.estimate("fireflies keep their value", rareReflection(std::ldexp(1.0, 17)), meanRadiance, 1,
                     0.05, {.samples = samples, .most = 4 * samples}, {{0, "values are clamped"}});
    // Values that are clamped, even above 2^17, are not proportional to the lamp.
    const Film dim = context.render(rareReflection(1), {.samples = samples}),
               bright = context.render(rareReflection(std::ldexp(1.0, 60)), {.samples = samples});
    bool proportional = radiance(dim) > 0;
    for (std::uint32_t y = 0; y < dim.shape().height; ++y)
        for (std::uint32_t x = 0; x < dim.shape().width; ++x)
            for (std::uint32_t c = 0; c < 3; ++c)
                proportional = proportional && bright.mean(x, y, c) == std::ldexp(dim.mean(x, y, c), 60);
    context.holds("a lamp 2^60 times as bright makes an image 2^60 times as bright", proportional,
                  "same bits", "values are clamped");
}

}  // namespace

std::vector<Case> accumulationCases() {
    constexpr std::uint64_t samplers =
        kDirectLight | CRT_FEATURE_SOBOL | CRT_FEATURE_INDEPENDENT | CRT_FEATURE_XORSHIFT;
    return {
        row("I01", "constant-pixel",
            "2^10 and 2^20 samples of a constant (2^24 and 2^25 at level merge, 2^27 at level nightly)",
            "the constant",
            "a float sum stands still at 2^24", "1e-6", Level::Commit, CRT_FEATURE_VIEW, constantPixel),
        row("I02", "noisy-pixel",
            "2^20 independent samples of A03 (2^24 at level merge, 2^27 at level nightly)",
            "0.2394564705", "rectangle formula", "4σ/√n + 1e-6", Level::Commit,
            kDirectLight | CRT_FEATURE_INDEPENDENT, noisyPixel),
        row("I03", "high-indices", "Samples around number 2^31, 2^32, 2^40 and 2^52",
            "A03, by other samples than the first", "rectangle formula", "2 %", Level::Commit, samplers,
            highIndices),
        row("I04", "merging", "Ranges of samples rendered apart and merged in any order", "the whole", "–",
            "same bits", Level::Commit, samplers, merging),
        row("I05", "threads-and-tiles", "1, 2, 7 and 64 threads; tiles of 1, 8, 13 and 128", "one image",
            "–", "same bits", Level::Commit, kDirectLight, threadsAndTiles),
        row("I06", "seeds", "Seeds 0, 1, 2^32 and 2^63 − 1", "A03, with different noise",
            "rectangle formula", "2 %", Level::Commit, samplers, seeds),
        row("I07", "neighbours", "Noise of neighbouring pixels", "uncorrelated", "–", "|r| < 4/√n",
            Level::Commit, samplers, neighbours),
        row("I08", "streams", "Noise of neighbouring seeds", "uncorrelated", "numpy #16313", "|r| < 4/√n",
            Level::Commit, samplers, streams),
        row("I09", "draws", "The numbers of 131072 pixels in six dimensions of every sampler",
            "uniform and uncorrelated", "Kolmogorov and Smirnov", "p > 1e-4 over all tests", Level::Commit,
            0, draws),
        row("I10", "residuals", "Noise of two seeds, and of two ranges of samples", "uncorrelated", "–",
            "|r| < 4/√n", Level::Commit, samplers, residuals),
        row("I11", "sobol",
            "Elementary intervals of Sobol points, also beyond 2^32 "
            "and in dimension 4001; prefixes of 3, 100 and 1000",
            "one point in each; unbiased", "Sobol', Owen", "exactly; ± 1 %", Level::Commit,
            kDirectLight | CRT_FEATURE_SOBOL, sobol),
        row("I12", "coverage", "95 % intervals of 400 pixels from 16 scrambles each",
            "cover the truth in 90 to 98 %", "Student", "0.94 ± 0.04", Level::Commit, samplers, coverage),
        row("I13", "infinite-samples", "Radiance 1e37, which rare wavelengths weigh beyond single precision",
            "infinite samples are dropped and counted", "–", "finite", Level::Commit, kDirectLight,
            infiniteSamples),
        row("I14", "no-clamping", "One path in 2^17 that brings 2^17, and a lamp 2^60 times as bright",
            "mean 1; the image times 2^60", "Fresnel's equations; powers of two round nothing",
            "± 5 %; same bits", Level::Merge, CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT, noClamping),
    };
}

}  // namespace crt::verify
